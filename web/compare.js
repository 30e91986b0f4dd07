// Two or more runs side by side, and whether they tell the same north.

import { get } from "./api.js";
import { $, fill, h } from "./dom.js";
import { decimals, fixed, locale, near } from "./format.js";
import { t } from "./i18n.js";
import { columns, row, titled } from "./tables.js";

const fitted = (letter, k) => ({ gyro_fit: fit }) => fit && [fit[`${letter}_deg_h`], Math.sqrt(fit.covariance_deg2_h2[k][k])];
const NUMBERS = {
  "azimuth, °": (r) => [r.azimuth_deg, r.azimuth_sigma_deg],
  "R, °/h": fitted("R", 0),
  "a, °/h": fitted("a", 1),
  "b, °/h": fitted("b", 2),
  "tilt ε, °": ({ tilt }) => tilt && [tilt.epsilon_deg, tilt.sigma_deg],
  "pitch, °": ({ tilt, pitch_deg, level_sigma_deg }) => levelled(tilt?.pitch_deg ?? pitch_deg, tilt?.sigma_deg ?? level_sigma_deg),
  "roll, °": ({ tilt, roll_deg, level_sigma_deg }) => levelled(tilt?.roll_deg ?? roll_deg, tilt?.sigma_deg ?? level_sigma_deg),
};

const levelled = (deg, sigma) => (sigma ? [deg, sigma] : null); // a heading that is held states no sigma of the level

export function mount(store) {
  const panel = $("compare");
  async function show({ compare, lang }) {
    if (compare.length < 2) return fill(panel, "", () => []);
    const runs = await Promise.all(compare.map((id) => get(`/runs/${id}`)));
    if (compare !== store.state.compare) return; // chosen anew meanwhile
    fill(panel, compare.join() + lang, () => view(runs));
    panel.scrollIntoView({ block: "nearest" });
  }

  function close() {
    store.set({ compare: [] });
    $("history").querySelector(".scroll").focus({ preventScroll: true }); // where the runs were chosen
  }

  function view(all) {
    const runs = all.filter((run) => run.result?.azimuth_deg != null);
    const when = (run) => new Date(run.created).toLocaleString(locale(), { dateStyle: "medium", timeStyle: "short" });
    const picked = Object.entries(NUMBERS).map(([name, pick]) => [name, runs.map((run) => pick(run.result))]);
    const rows = picked.filter(([, cells]) => cells.some(Boolean)).map(([name, cells]) => row(t(name), ...cells.map((cell) => (cell ? plusMinus(...cell) : "–"))));
    rows.push(row(t("azimuth less the first's, °"), ...runs.map((run, k) => (k ? verdict(runs[0].result, run.result) : ""))));
    return [
      titled(t("Compare"), h("button.link", { type: "button", onclick: close }, t("close"))),
      h("div.scroll", { tabindex: 0, role: "region", "aria-label": t("Compare") }, h("table.rows", {}, h("thead", {}, columns(...runs.map((run) => [when(run), h("small", {}, `${t(run.kind)} · ${run.rig_name}`)]))), h("tbody", {}, ...rows))),
      h("p.note", {}, t("compare.note"), " ", runs.length < all.length ? t("{n} of the chosen runs have no result.", { n: all.length - runs.length }) : ""),
    ];
  }

  store.on("compare", (state) => show(state).catch((problem) => fill(panel, problem.message, () => [h("p.error", { role: "alert" }, problem.message)])));
}

const plusMinus = (value, one) => `${fixed(value, decimals(2 * one))} ±${(2 * one).toFixed(decimals(2 * one))}`;

// ISO 13528's E_n: the difference over its combined expanded uncertainty.
function verdict(one, other) {
  const apart = near(other.azimuth_deg - one.azimuth_deg, 0);
  const both = Math.hypot(one.azimuth_sigma_deg, other.azimuth_sigma_deg);
  const ratio = Math.abs(apart) / (2 * both);
  return `${plusMinus(apart, both)} · ${t(ratio <= 1 ? "✓ consistent" : "▲ not consistent")}, E_n ${ratio.toFixed(2)}`;
}
