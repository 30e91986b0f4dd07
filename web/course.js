// How a heading went: moment by moment from the result, or from what was told so far.

import { axis, label } from "./charts.js";
import { t } from "./i18n.js";

const MOST_POINTS = 900;
const UNITS = [["h", 3600, 3 * 3600], ["min", 60, 240], ["s", 1, 0]]; // name, seconds, and from where it is used
const KEYS = ["time_s", "azimuth_deg", "azimuth_sigma_deg", "pitch_deg", "roll_deg"];

/** The moments, `{time_s, azimuth_deg, azimuth_sigma_deg, pitch_deg, roll_deg}`, thinned to what a chart can show. */
export function course({ run, estimates }) {
  const history = run?.result?.history;
  if (history) return thinned(history.time_s.length).map((k) => Object.fromEntries(KEYS.map((key) => [key, history[key][k]])));
  const anew = estimates.findLastIndex((one, k) => k && one.time_s < estimates[k - 1].time_s); // after a gap it began again
  const since = estimates.slice(Math.max(0, anew));
  return thinned(since.length).map((k) => since[k]);
}

// The newest is always among them.
function thinned(n) {
  const step = Math.ceil(n / MOST_POINTS);
  return Array.from({ length: Math.ceil(n / step || 0) }, (_, k) => n - 1 - k * step).reverse();
}

/** How long the run is planned to take, in all. */
export const wholeS = ({ plan }) => plan.duration_s + (plan.rest_s ?? 0) + (plan.warm_s ?? 0);

/** The axis of time, from the run's beginning to its end, in the unit that suits: `{axis, note, scale}`. */
export function timeAxis(look, end_s, more) {
  const [unit, scale] = UNITS.find(([, , from_s]) => end_s >= from_s);
  const end = end_s / scale;
  return {
    axis: axis(look, { range: [0, end], nticks: look.width > 480 ? 8 : 5, ...more }),
    note: label(t(`time, ${unit}`), end, 0, { yref: "paper", xanchor: "right", yanchor: "top", yshift: -1.7 * look.size }),
    scale,
  };
}
