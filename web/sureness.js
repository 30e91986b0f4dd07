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

function build(state, look) {
  const { run } = state;
  if (!run?.plan.duration_s) return { data: [], layout: {}, text: "" };
  const moments = course(state);
  const grows = run.kind === "heading-hold";
  const whole_s = wholeS(run);
  const time = timeAxis(look, Math.max(whole_s, moments.at(-1)?.time_s ?? 0), { nticks: 5 });
  const x = moments.map((one) => one.time_s / time.scale);
  const u = moments.map((one) => 2 * one.azimuth_sigma_deg);
  const predicted = 2 * (run.prediction?.azimuth_sigma_deg ?? moments.at(-1)?.azimuth_sigma_deg ?? 1);
  const all = [...u, predicted];
  const [least, most] = [Math.min, Math.max].map((of) => all.reduce((a, b) => of(a, b)));
  const range = grows ? [0, 1.15 * most] : [Math.log10(least / 1.6), Math.log10(1.3 * Math.max(most, 4 * least))];
  const level = grows ? predicted : Math.log10(predicted);
  const end = whole_s / time.scale;
  return {
    data: [
      curve(x, u, look.blue), points([end], [predicted], look.blue, "circle", 7, null, look.paper),
      points(x.slice(-1), u.slice(-1), look.blue, "circle", 7),
    ],
    layout: {
      margin: { b: 3.4 * look.size, l: 4.6 * look.size },
      xaxis: time.axis,
      yaxis: grows ? axis(look, { range, nticks: 5 }) : logAxis(look, range),
      shapes: [line(0, predicted, 1, predicted, look.edge, { xref: "paper" }, "1.5px,2.5px")],
      annotations: [
        heading(look, t("±2σ, °")), time.note,
        label(`${t("predicted")} ${plusMinus(predicted / 2)}`, end, level, { xanchor: "right", yanchor: grows ? "bottom" : "top", yshift: grows ? 4 : -4, xshift: -6, font: { color: look.ink2 } }),
      ],
    },
    text: t("sureness.text", { u: plusMinus(moments.at(-1)?.azimuth_sigma_deg), v: plusMinus(predicted / 2) }),
  };
}
