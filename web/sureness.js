// How sure the heading is: an alignment grows surer, a heading that is held less so.

import { axis, createChart, curve, heading, label, line, logAxis, points } from "./charts.js";
import { course, timeAxis, wholeS } from "./course.js";
import { $, h, write } from "./dom.js";
import { plusMinus } from "./format.js";
import { t } from "./i18n.js";

export function mount(store) {
  const title = h("h2");
  const chart = h("div.settle-chart");
  $("sureness").append(title, chart);
  store.on("run", ({ run }) => write(title, t(run?.kind === "heading-hold" ? "How it grows uncertain" : "How it settles")));
  createChart(chart, store, ["run", "estimates"], (look) => build(store.state, look));
}

const SEEN = 0.3; // growth less than this share of the beginning hardly shows on a linear axis

function build(state, look) {
  const { run } = state;
  if (!run?.plan.duration_s) return { data: [], layout: {}, text: "" };
  const moments = course(state);
  const grows = run.kind === "heading-hold";
  const now = moments.at(-1);
  const whole_s = wholeS(run);
  const time = timeAxis(look, Math.max(whole_s, now?.time_s ?? 0), { nticks: 5 });
  const x = moments.map((one) => one.time_s / time.scale);
  const u = moments.map((one) => 2 * one.azimuth_sigma_deg);
  const predicted = 2 * (run.prediction?.azimuth_sigma_deg ?? now?.azimuth_sigma_deg ?? 1);
  const begin = grows ? 2 * run.plan.start.azimuth_sigma_deg : 0;
  const since = (all) => Math.sqrt(Math.max(0, all ** 2 - begin ** 2)); // what the hold itself has added
  const added = grows ? u.map(since) : [];
  const linear = grows && since(predicted) > SEEN * begin;
  const { yaxis, height } = linear ? upright(look, predicted, u) : logarithmic(look, grows ? since(predicted) / 20 : predicted, [...u, predicted]);
  const end = whole_s / time.scale;
  const named = (word, values) => values.at(-1) > yaxis.range.map((one) => (linear ? one : 10 ** one))[0] && label(t(word), x.at(-1), height(values.at(-1)), { xanchor: x.at(-1) > end / 2 ? "right" : "left", yanchor: "bottom", yshift: 6, xshift: x.at(-1) > end / 2 ? -6 : 6, font: { color: look.ink2 } });
  return {
    data: [
      curve(x, u, look.blue), curve(x, added.map((one) => one || null), look.blue, "5px,3px"),
      points([end], [predicted], look.blue, "circle", 7, null, look.paper), points(x.slice(-1), u.slice(-1), look.blue, "circle", 7),
    ],
    layout: {
      margin: { b: 3.4 * look.size, l: 4.6 * look.size }, xaxis: time.axis, yaxis,
      shapes: [line(0, predicted, 1, predicted, look.edge, { xref: "paper" }, "1.5px,2.5px")],
      annotations: [
        heading(look, t("±2σ, °")), time.note, grows && named("added since the start", added),
        label(`${t("predicted")} ${plusMinus(predicted / 2)}`, end, height(predicted), { xanchor: "right", yanchor: "bottom", yshift: 4, xshift: -6, font: { color: look.ink2 } }),
      ].filter(Boolean),
    },
    text: t("sureness.text", { u: plusMinus(now?.azimuth_sigma_deg), v: plusMinus(predicted / 2) }),
  };
}

const largest = (values) => values.reduce((a, b) => Math.max(a, b), 0);

function upright(look, predicted, u) {
  return { yaxis: axis(look, { range: [0, 1.2 * largest([...u, predicted])], nticks: 5 }), height: (value) => value };
}

function logarithmic(look, least, values) {
  const most = Math.max(largest(values), 4 * least);
  return { yaxis: logAxis(look, [Math.log10(least / 1.6), Math.log10(1.5 * most)]), height: (value) => Math.log10(Math.max(value, least / 1.6)) };
}
