// The finished run in numbers: what each solver says, and everything that was fitted.

import { $, fill, h } from "./dom.js";
import { decimals, fine, fixed, near, plusMinus } from "./format.js";
import { t } from "./i18n.js";
import { columns, row, titled } from "./tables.js";

const SOLVERS = { coordinate_transform: "Coordinate transform", vector: "Vector, exact", two_vector: "Two-vector" };
const COMPARED = { vector_published: "Vector as published, eq 10", vector_uncorrected: "Uncorrected, eq 11", uncompensated: "Tilt left out" };

export function mount(store) {
  store.on("run", ({ run, lang }) => {
    if (!run?.result?.gyro_fit) return;
    fill($("solvers"), run.run_id + lang, () => solvers(run.result));
    fill($("numbers"), run.run_id + lang, () => numbers(run.result));
  });
}

function solvers({ solutions, azimuth_sigma_deg: sigma, azimuth_deg: reported }) {
  const places = decimals(2 * sigma);
  const rows = (names, digits) => Object.entries(names).map(([name, words]) => {
    const { azimuth_deg: deg } = solutions[name];
    return row(t(words), `${deg.toFixed(places)}°`, name === "coordinate_transform" ? t("reported") : difference(near(deg, reported) - reported, digits));
  });
  return [
    titled(t("Solvers"), t("each {u}", { u: plusMinus(sigma) })),
    h("table.rows", {}, h("thead", {}, columns(t("azimuth"), t("difference"))), h("tbody", {}, ...rows(SOLVERS, 6)),
      h("tbody.quiet", {}, h("tr", {}, h("th.note", { colspan: 3 }, t("For comparison with the paper; not used"))), ...rows(COMPARED, places + 1))),
  ];
}

// A difference too small for its digits is said to be so: "0.000 000" would claim to be none.
function difference(deg, digits) {
  const least = 10 ** -digits;
  return deg !== 0 && Math.abs(deg) < least / 2 ? `< ${fine(least, digits)}°` : `${fine(deg, digits)}°`;
}

function numbers({ gyro_fit: gyro, accelerometer_fit: accel, tilt, earth_rate: earth }) {
  const one = (name, value, sigma, unit, last) => row(name, value == null ? "–" : fixed(value, decimals(2 * sigma)) + unit, last ?? `±${(2 * sigma).toFixed(decimals(2 * sigma))}`);
  const group = (name, ...rows) => h("tbody", {}, h("tr", {}, h("th", { colspan: 3, scope: "rowgroup" }, t(name))), ...rows);
  const fit = (name, part, suffix, covariance, unit, scale = 1) => {
    const sigma = part[`residual_sigma_${suffix}`] * scale;
    const rows = ["R", "a", "b"].map((letter, k) => one(letter, part[`${letter}_${suffix}`] * scale, Math.sqrt(covariance[k][k]) * scale, unit));
    return group(name, ...rows, one(t("residual"), sigma, sigma / 20, unit, `χ² ${part.chi2?.toFixed(1) ?? "–"}/${part.dof}`));
  };
  const { horizontal_measured_deg_h: measured, horizontal_expected_deg_h: expected, z } = earth;
  const sigma = z ? Math.abs((measured - expected) / z) : gyro.residual_sigma_deg_h;
  const angles = { epsilon: "ε size", zeta: "ζ downhill", pitch: "pitch", roll: "roll" };
  return [
    titled(t("Numbers"), t("±2σ, noise only")),
    h("table.numbers", {},
      fit("Gyro", gyro, "deg_h", gyro.covariance_deg2_h2, " °/h"), fit("Accelerometer", accel, "g", accel.covariance_g2, " mg", 1000),
      group("Tilt", ...Object.entries(angles).map(([key, name]) => one(t(name), tilt[`${key}_deg`], key === "zeta" ? (tilt.sigma_deg / tilt.epsilon_deg) * (180 / Math.PI) : tilt.sigma_deg, "°"))),
      group("Horizontal Earth rate", one(t("measured"), measured, sigma, " °/h"), one(t("expected"), expected, sigma / 10, " °/h", `z ${fixed(z ?? 0, 1)}`))),
  ];
}
