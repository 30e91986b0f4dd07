// The Allan deviation of both sensors, log over log, with its 95 % band and the model of the figures.

import { axis, createChart, curve, heading, label, logAxis, points } from "./charts.js";
import { $, h, write } from "./dom.js";
import { t } from "./i18n.js";
import { newest } from "./run.js";

const SENSORS = { gyro: ["Gyro", "deviation, °/h"], accelerometer: ["Accelerometer", "deviation, g"] };
const ROOM = 0.12; // of a decade, at both ends

export function mount(store) {
  const parts = ["h2", "span.key", "span.key.band", "span.key.stroke"].map((what) => h(what));
  const charts = Object.keys(SENSORS).map((sensor) => [sensor, h("h3"), h("div.fit-chart")]);
  $("allan").append(h("header", {}, ...parts), h("div.pair", {}, ...charts.map(([, name, chart]) => h("div", {}, name, chart))));
  store.on(["lang"], () => {
    [t("Allan deviation"), t("measured"), "95 %", t("model")].forEach((text, k) => write(parts[k], text));
    for (const [sensor, name] of charts) write(name, t(SENSORS[sensor][0]));
  });
  for (const [sensor, , chart] of charts) createChart(chart, store, ["run", "estimates"], (look) => build(store.state, sensor, look));
}

const decade = (value) => Math.log10(value);

function build(state, sensor, look) {
  const { run } = state;
  if (run?.kind !== "noise") return { data: [], layout: {}, text: "" };
  const { tau_s: tau = [], deviation = [], low95 = [], high95 = [], model = [] } = newest(state)?.[sensor]?.allan ?? {};
  const quantity = t(SENSORS[sensor][1]);
  const layout = { margin: { b: 3.4 * look.size, l: 5.2 * look.size }, annotations: [heading(look, quantity)] };
  const log = (values) => logAxis(look, [Math.min(...values) - ROOM, Math.max(...values) + ROOM]);
  const empty = axis(look, { range: [0, 1], ticks: "", showticklabels: false });
  if (!tau.length) return { data: [], layout: { ...layout, xaxis: empty, yaxis: empty }, text: t("noise.wait") };

  const across = [decade(tau[0]), decade(Math.max(tau.at(-1), run.plan.duration_s / 4))]; // where it will end is seen from the beginning
  const upwards = deviation.filter((value) => value > 0).map(decade).concat(model.map(decade));
  const xaxis = log(across);
  const yaxis = log(upwards);
  const top = 10 ** (yaxis.range[1] + 1);
  const high = high95.map((value) => value ?? top); // open above: too few of them to bound it
  layout.annotations.push(label("τ, s", xaxis.range[1], 0, { yref: "paper", xanchor: "right", yanchor: "top", yshift: -1.7 * look.size }));
  return {
    data: [
      curve([...tau, ...tau.toReversed()], [...high, ...low95.toReversed()], "transparent", "", { fill: "toself", fillcolor: look.band }),
      curve(tau, model, look.ink), points(tau, deviation, look.blue, "circle", 4.5, null, null, { cliponaxis: true }),
    ],
    layout: { ...layout, xaxis, yaxis },
    text: t("allan.text", { sensor: t(SENSORS[sensor][0]), n: tau.length, from: tau[0].toPrecision(2), to: tau.at(-1).toPrecision(2) }),
  };
}
