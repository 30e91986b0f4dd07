// A finished alignment or heading hold in numbers.

import { $, fill, h } from "./dom.js";
import { count, decimals, duration, fixed, plusMinus } from "./format.js";
import { t } from "./i18n.js";
import { row, titled } from "./tables.js";

export function mount(store) {
  store.on("run", ({ run, lang }) => {
    if (!run?.result?.history) return;
    fill($("numbers"), run.run_id + lang, () => [titled(t("Numbers"), t("±2σ")), h("table.numbers", {}, ...groups(run))]);
  });
}

function groups({ result, plan, site }) {
  const level = result.level_sigma_deg;
  const offset = site.reference_offset_deg;
  return [
    group("Attitude", one("azimuth", result.azimuth_deg, result.azimuth_sigma_deg, "°"), offset ? one("reference line", result.reference_azimuth_deg, result.azimuth_sigma_deg, "°") : null,
      one("pitch", result.pitch_deg, level, "°"), one("roll", result.roll_deg, level, "°")),
    result.start ? group("Held from", row(t(result.start.kind), `${fixed(result.start.azimuth_deg, decimals(2 * result.start.azimuth_sigma_deg))}°`, plusMinus(result.start.azimuth_sigma_deg))) : null,
    result.gyro_bias_deg_h && plan.rest_s ? group("Gyro bias", ...result.gyro_bias_deg_h.map((bias, k) => row("xyz"[k], `${fixed(bias, 3)} °/h`, ""))) : null,
    group("Samples",
      row(t("method"), t(`method.${result.method}`), ""), row(t("duration"), duration(result.duration_s ?? plan.duration_s), ""),
      result.restarts == null ? null : row(t("began anew"), count(result.restarts), ""), row(t("bridged"), count(result.bridged_samples), "")),
  ];
}

const group = (name, ...rows) => h("tbody", {}, h("tr", {}, h("th", { colspan: 3, scope: "rowgroup" }, t(name))), ...rows);

function one(name, value, sigma, unit) {
  const places = sigma ? decimals(2 * sigma) : 3;
  return row(t(name), fixed(value, places) + unit, sigma ? `±${(2 * sigma).toFixed(places)}` : "");
}
