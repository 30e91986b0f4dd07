// Every visit's rate and what the fitted cosine leaves of it, reckoned as the service fitted it.

import { wrap } from "./format.js";
import { newest } from "./run.js";

const radians = (deg) => (deg * Math.PI) / 180;

/** By how much the mean over a sector feels the harmonic; 1 where the table stands. */
function felt({ modulation, positions }) {
  const half = Math.PI / positions;
  return modulation === "continuous" ? Math.sin(half) / half : 1;
}

/**
 * Every visit with its rate and residual; each segment's own R and drift give way to the first one's R,
 * so that one curve, `value`, fits all. `shifted` names the sentence that says so.
 */
export function reduce(state) {
  const { visits, run } = state;
  const latest = newest(state);
  if (!latest?.gyro_fit) return { rows: visits.map((v) => ({ ...v, rate: v.gyro_mean_deg_h })), shifted: "" };
  const { R_deg_h: R, a_deg_h: a, b_deg_h: b } = latest.gyro_fit;
  const mount_deg = run?.rig?.config?.gyro?.mount_angle_deg ?? 0;
  const value = (deg) => R + a * Math.cos(radians(deg + mount_deg)) + b * Math.sin(radians(deg + mount_deg));
  const away = new Set(latest.left_out.map(({ visit }) => visit));
  const share = felt(run.plan);
  const rows = latest.segments.flatMap(({ segment, R_deg_h: own, drift_deg_h_h: drift }) => {
    const some = visits.filter((v) => v.segment === segment).map((v) => ({ ...v, leftOut: away.has(v.index) }));
    const used = some.filter((v) => !v.leftOut);
    const middle_s = used.reduce((sum, v) => sum + v.start_s, 0) / used.length;
    return some.map((v) => {
      const rate = (v.gyro_mean_deg_h - own - ((drift ?? 0) * (v.start_s - middle_s)) / 3600) / share + R;
      return { ...v, rate, residual: rate - value(v.angle_deg) };
    });
  });
  const shifted = latest.segments.length > 1 ? "fit.segments" : latest.segments[0].drift_deg_h_h != null ? "fit.drift" : "";
  return { rows, value, north: wrap(latest.azimuth_deg - mount_deg), shifted };
}
