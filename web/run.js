// What the run shown means: its phase, its legs, where it stands and what north it knows.

import { digits, sentence } from "./format.js";

export const ENDED = ["completed", "failed", "aborted", "interrupted"];
const PHASES = { queued: "running", failed: "stopped", interrupted: "stopped", aborted: "ended" };

/** One of connecting, idle, running, paused, completed, stopped, ended. */
export const phase = ({ run, loaded }) => (run ? PHASES[run.state] ?? run.state : loaded ? "idle" : "connecting");

/** What kind of run is shown, or would be begun. */
export const kindOf = ({ run, kind }) => run?.kind ?? kind;

/** The visits that a run plans, or made, in order; only a north-seek's table turns. */
export const schedule = (run) => (run.kind === "north-seek" ? (run.result ? measured(run.result.visits) : run.prediction?.schedule ?? []) : []);

/** Whether a run that stopped can be carried on: what the others missed meanwhile is what they are about. */
export const resumable = (run) => run?.kind === "north-seek";

/** The visits planned: of the run shown, or of the next one. */
export const planned = ({ run, prediction }) => (run ? schedule(run) : prediction?.schedule ?? []);

/** The visits that count for the plan: not those that only prove that nothing moved. */
export const measured = (visits) => visits.filter((visit) => visit.repeats == null);

/** Where the k-th planned visit (from 0) stands in its direction: `{direction, n, of}`. */
export function place(visits, k) {
  const direction = visits[Math.min(k, visits.length - 1)]?.direction;
  const same = (some) => some.filter((visit) => visit.direction === direction).length;
  return { direction, n: same(visits.slice(0, k + 1)), of: same(visits) };
}

/** The result, or what the newest estimate says so far. */
export const newest = ({ run, estimates }) => run?.result ?? estimates.at(-1);

/** North as it is known now, `{azimuth_deg, azimuth_sigma_deg}`, or null. */
export function north(state) {
  const known = newest(state) ?? state.run;
  return known?.azimuth_sigma_deg > 0 && known.azimuth_sigma_deg < 60 ? known : null;
}

/** Whether a run completed but failed one of its checks: its north is not to be used. */
export const doubtful = (run) => run?.state === "completed" && Boolean(run.checks?.fail);

/** What stopped a run, `[headline, the rest]`, without where it was: the page shows that elsewhere. */
export function reason({ error }) {
  const words = error.replace(/^(to see that nothing moved, )?visit [^:]*: /, "");
  const [, headline = words, rest = ""] = /^(.{20,90}?)[.;:] (.+)$/s.exec(words) ?? [];
  return [sentence(headline), rest && sentence(rest)];
}

/** The runs on record, the one shown as it is now. */
export const live = ({ runs, run, estimates }) => runs.map((one) => {
  if (one.run_id !== run?.run_id) return one;
  const { azimuth_deg, azimuth_sigma_deg, gyro } = newest({ run, estimates }) ?? one;
  const walk = gyro?.angle_random_walk_deg_sqrt_h?.value;
  return { ...one, state: run.state, progress: run.progress, azimuth_deg, azimuth_sigma_deg, ...(walk && { figure: `${digits(walk)} deg/sqrt(h)` }) };
});

/** How often the dial exaggerates its wedge: 1, 2, 5, 10 ... so that the predicted 2 sigma ends at 4 to 10 degrees. */
export function exaggeration(sigmaDeg) {
  const most = 5 / sigmaDeg;
  if (!(most >= 1 && most < 1e9)) return 1;
  const decade = 10 ** Math.floor(Math.log10(most) + 1e-9);
  return decade * [5, 2, 1].find((step) => most >= step * decade * 0.999);
}

/** Seconds of the reader's own clock until the run ends, negative once it is late, or null where nobody knows. */
export function leftS({ progress, rig, run }) {
  if (run?.state !== "running" || progress?.left_s == null) return null;
  return progress.left_s / (rig?.speed || 1) - (performance.now() - progress.heard_ms) / 1000;
}

/** Whether the newest run of this rig waits for a resume or an end. */
export function waiting({ runs, rig, run }) {
  const latest = runs.find((other) => other.rig_name === rig?.name);
  return resumable(latest) && ["failed", "interrupted"].includes(latest && (latest.run_id === run?.run_id ? run : latest).state);
}
