// The heading over time with two sigma, pitch and roll beneath: of an alignment, or of a heading that is held.

import { axis, azimuthAxis, createChart, curve, heading, label, points } from "./charts.js";
import { course, timeAxis, wholeS } from "./course.js";
import { $, h, write } from "./dom.js";
import { fixed, near, plusMinus } from "./format.js";
import { t } from "./i18n.js";

const SETTLED = 2; // the axis shows what is at most so many times as uncertain as now; the rest is cut off

export function mount(store) {
  const [title, band, aside] = [h("h2"), h("span.key.band"), h("p.aside")];
  const chart = h("div.fit-chart");
  $("track").append(h("header", {}, title, band, aside), chart);
  store.on(["run", "estimates"], (state) => {
    write(title, t("Heading"));
    write(band, "±2σ");
    write(aside, told(state));
  });
  createChart(chart, store, ["run", "estimates"], (look) => build(store.state, look));
}

function told({ run, estimates }) {
  const { pitch_deg, roll_deg } = run?.result ?? estimates.at(-1) ?? {};
  return pitch_deg == null ? "" : `${t("pitch")} ${fixed(pitch_deg, 3)}° · ${t("roll")} ${fixed(roll_deg, 3)}°`;
}

function build(state, look) {
  const { run } = state;
  if (!run?.plan.duration_s) return { data: [], layout: {}, text: "" };
  const moments = course(state);
  const last = moments.at(-1);
  const time = timeAxis(look, Math.max(wholeS(run), last?.time_s ?? 0), { anchor: "y2" });
  const roomy = look.width > 420;
  const layout = {
    margin: { b: 3.4 * look.size, r: roomy ? 4.5 * look.size : look.size },
    annotations: [heading(look, t("azimuth, °, ±2σ")), heading(look, t("pitch, roll, °"), "y2"), time.note], shapes: [],
    xaxis: time.axis,
  };
  const nothing = axis(look, { range: [-1, 1], ticks: "", showticklabels: false });
  const domains = { yaxis: { domain: [0.44, 1] }, yaxis2: { domain: [0, 0.3] } };
  if (!last) return { data: [], layout: { ...layout, yaxis: { ...nothing, ...domains.yaxis }, yaxis2: { ...nothing, ...domains.yaxis2 } }, text: t("track.none") };

  const x = moments.map((one) => one.time_s / time.scale);
  const azimuths = moments.map((one) => near(one.azimuth_deg, last.azimuth_deg));
  const settled = [...moments.keys()].filter((k) => moments[k].azimuth_sigma_deg <= SETTLED * last.azimuth_sigma_deg);
  const edges = settled.flatMap((k) => [-2, 2].map((sign) => azimuths[k] + sign * moments[k].azimuth_sigma_deg));
  const [low, high] = ranged(edges, 0.08);
  const cut = (deg) => Math.max(2 * low - high, Math.min(2 * high - low, deg));
  const edge = (sign) => azimuths.map((deg, k) => cut(deg + sign * moments[k].azimuth_sigma_deg));
  const tilts = ["pitch_deg", "roll_deg"].map((key) => moments.map((one) => one[key]));
  const tilt = (values, dash) => curve(x, values, look.blue, dash, { yaxis: "y2" });
  layout.annotations.push(...rest(run, time, look, layout.shapes), ...(roomy ? named(tilts, last, time.scale, look) : []));
  return {
    data: [
      curve([...x, ...x.toReversed()], [...edge(2), ...edge(-2).toReversed()], "transparent", "", { fill: "toself", fillcolor: look.band }),
      curve(x, azimuths.map(cut), look.blue), points(x.slice(-1), azimuths.slice(-1), look.blue, "circle", 7),
      tilt(tilts[0]), tilt(tilts[1], "5px,3px"),
    ],
    layout: {
      ...layout,
      yaxis: { ...azimuthAxis(look, low, high), ...domains.yaxis },
      yaxis2: axis(look, { range: ranged(settled.flatMap((k) => tilts.map((values) => values[k])), 0.2), nticks: 4, ...domains.yaxis2 }),
    },
    text: t("track.text", { seconds: Math.round(last.time_s), azimuth: last.azimuth_deg.toFixed(3), u: plusMinus(last.azimuth_sigma_deg) }),
  };
}

function ranged(values, share) {
  const low = values.reduce((a, b) => Math.min(a, b));
  const high = values.reduce((a, b) => Math.max(a, b));
  const room = share * (high - low) || 0.01;
  return [low - room, high + room];
}

// The higher of the two is named above its end, the lower below: they may lie close together.
function named([pitch, roll], last, scale, look) {
  const above = pitch.at(-1) >= roll.at(-1);
  return [["pitch", last.pitch_deg, above], ["roll", last.roll_deg, !above]].map(([word, y, up]) =>
    label(t(word), last.time_s / scale, y, { yref: "y2", xanchor: "left", xshift: 5, yanchor: up ? "bottom" : "top", yshift: up ? -0.5 * look.size : 0.5 * look.size, font: { color: look.ink2 } }));
}

// While the base rests, the gyro's bias is measured; the heading is held from then on.
function rest({ plan }, { scale }, look, shapes) {
  if (!plan.rest_s) return [];
  shapes.push({ type: "rect", yref: "paper", x0: 0, x1: plan.rest_s / scale, y0: 0, y1: 1, fillcolor: look.wash, line: { width: 0 }, layer: "below" });
  return [label(t("at rest"), 0, 1, { yref: "y domain", xanchor: "left", yanchor: "top", xshift: 4, font: { color: look.ink2 } })];
}
