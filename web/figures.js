// What noise the sensors have: each figure with its 95 % interval, so far or at the end.

import { $, fill, h } from "./dom.js";
import { count, digits, duration, fixed, interval, sentence } from "./format.js";
import { t } from "./i18n.js";
import { newest } from "./run.js";
import { columns, row, titled } from "./tables.js";

const SIGNS = { "deg/sqrt(h)": "°/√h", "deg/h": "°/h", "deg/h/sqrt(h)": "°/h/√h", "deg/h/h": "°/h²", arcsec: "″", g: "g", "g/sqrt(Hz)": "g/√Hz", "g/sqrt(h)": "g/√h", "g/h": "g/h", "g s": "g s" };
const SENSORS = { gyro: "Gyro", accelerometer: "Accelerometer" };

export function mount(store) {
  store.on(["run", "estimates"], (state) => {
    const { run, lang } = state;
    if (run?.kind !== "noise") return;
    const latest = newest(state);
    fill($("figures"), [run.run_id, run.state, latest?.gyro?.samples, lang], () => (latest ? table(latest, run) : [h("h2", {}, t("Figures")), h("p.note", {}, t("noise.wait"))]));
    if (run.result) fill($("numbers"), run.run_id + lang, () => numbers(run.result));
  });
}

function table(latest, run) {
  return [
    titled(t("Figures"), run.result ? "95 %" : t("so far")),
    h("table.rows.figure-table", {}, h("thead", {}, columns(t("value"), t("95 % interval"))), ...Object.entries(SENSORS).map(([key, name]) =>
      h("tbody", {}, h("tr", {}, h("th", { colspan: 3, scope: "rowgroup" }, t(name))), ...latest[key].figures.map(figure)))),
  ];
}

function figure(one) {
  const name = [t(one.name), h("small", {}, ` ${SIGNS[one.unit]}`)];
  if (one.value === null) return h("tr.quiet", {}, h("th", { scope: "row" }, ...name), h("td", { colspan: 2 }, one.upper === null ? t("not seen") : t("not seen, below {upper}", { upper: digits(one.upper) })));
  return h("tr", {}, h("th", { scope: "row" }, ...name), h("td", {}, digits(one.value)), h("td", {}, interval(one)));
}

function numbers({ gyro, accelerometer, suggestion }) {
  return [
    titled(t("Numbers"), ""),
    h("table.numbers", {}, ...[["Gyro", gyro, 3, " °/h"], ["Accelerometer", accelerometer, 6, " g"]].map(([name, sensor, places, unit]) => h("tbody", {},
      h("tr", {}, h("th", { colspan: 2, scope: "rowgroup" }, t(name))),
      row(t("mean"), fixed(sensor.mean, places) + unit),
      row(t("drift"), sensor.drift.seen ? `${`${sensor.drift.value < 0 ? "−" : ""}${digits(Math.abs(sensor.drift.value))}`} ${SIGNS[sensor.drift.unit]}` : t("not seen")),
      row(t("samples"), count(sensor.samples)),
      row(t("filled in"), count(sensor.filled)),
      row(t("recorded"), duration(sensor.samples * sensor.sample_period_s))))),
    suggestion && h("div.suggestion", {}, h("h2", {}, t("Next north-seek")), h("p.dwell.figures", {}, `${Number(suggestion.dwell_s.toPrecision(2))} `, h("small", {}, t("s each"))), h("p.note", { lang: "en" }, sentence(suggestion.reason))),
  ];
}
