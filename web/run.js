// What the run shown means: its phase, its legs, where it stands and what north it knows.

const PHASES = { queued: "running", failed: "stopped", interrupted: "stopped", aborted: "ended" };

/** One of connecting, idle, running, paused, completed, stopped, ended. */
export const phase = ({ run, loaded }) => (run ? PHASES[run.state] ?? run.state : loaded ? "idle" : "connecting");

/** The visits that are planned, in order. */
export const schedule = (run) => run?.prediction?.schedule ?? run?.result?.visits ?? [];

/** The visits that count for the plan: not those that only prove that nothing moved. */
export const measured = (visits) => visits.filter((visit) => visit.repeats == null);

/** Where the k-th planned visit (from 0) stands in its direction: `{direction, n, of}`. */
export function place(planned, k) {
  const direction = planned[Math.min(k, planned.length - 1)]?.direction;
  const same = (visits) => visits.filter((visit) => visit.direction === direction).length;
  return { direction, n: same(planned.slice(0, k + 1)), of: same(planned) };
}

/** North as it is known now, `{azimuth_deg, azimuth_sigma_deg}`, or null. */
export function north({ run, estimates }) {
  const known = run?.result ?? estimates.at(-1) ?? run;
  return known?.azimuth_sigma_deg < 60 ? known : null;
}

/** How often the dial exaggerates its wedge: 1, 2, 5, 10 ... so that the predicted 2 sigma ends at 4 to 10 degrees. */
export function exaggeration(sigmaDeg) {
  const most = 5 / sigmaDeg;
  if (!(most >= 1 && most < 1e9)) return 1;
  const decade = 10 ** Math.floor(Math.log10(most) + 1e-9);
  return decade * [5, 2, 1].find((step) => most >= step * decade * 0.999);
}

/** Seconds of the reader's own clock until the run ends, or null where nobody knows. */
export function leftS({ progress, rig, run }) {
  if (run?.state !== "running" || progress?.left_s == null) return null;
  return Math.max(0, progress.left_s / (rig?.speed || 1) - (performance.now() - progress.heard_ms) / 1000);
}

/** Whether the newest run of this rig waits for a resume or an end. */
export function waiting({ runs, rig, run }) {
  const newest = runs.find((other) => other.rig_name === rig?.name);
  return ["failed", "interrupted"].includes(newest && (newest.run_id === run?.run_id ? run : newest).state);
}
