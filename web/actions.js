// What can be done with the run shown, and what to do about one that did not complete.

import { openRun, post, startRun } from "./api.js";
import { $, all, setIcon, write } from "./dom.js";
import { plusMinus } from "./format.js";
import { prepare, why } from "./form.js";
import { t } from "./i18n.js";
import { ENDED, doubtful, measured, north, phase, place, reason, resumable, schedule } from "./run.js";

const SHAPES = { failed: "stopped", interrupted: "warn", aborted: "ended" };

export function mount(store) {
  let asked = {}; // what was asked of which run in which state, until it has an effect

  async function ask(step, act) {
    const { run } = store.state;
    asked = { run: run.run_id, state: run.state, step };
    show(store.state);
    await act(run).catch((problem) => { asked = { ...asked, step: null, refused: problem.message }; });
    show(store.state);
  }

  const take = (step) => ask(step, async ({ run_id, state }) => {
    await post(`/runs/${run_id}/${step}`);
    if (ENDED.includes(state)) await openRun(run_id, store); // its stream had ended
  });
  for (const button of all("[data-step]")) button.addEventListener("click", () => take(button.dataset.step));
  for (const button of all("[data-again]")) button.addEventListener("click", () => ask("again", ({ plan }) => startRun(anew(plan), store)));
  $("hold-heading").addEventListener("click", () => prepare("heading-hold", { from_run: store.state.run.run_id }, store));
  $("use-dwell").addEventListener("click", () => prepare("north-seek", { dwell_s: Number(store.state.run.result.suggestion.dwell_s.toPrecision(2)), target_sigma_deg: "" }, store));
  $("compare-runs").addEventListener("click", () => store.set({ compare: [store.state.run, other(store.state)].map((run) => run.run_id) }));

  function show(state) {
    const { run, connection } = state;
    if (!run) return;
    if (asked.run !== run.run_id || asked.state !== run.state) asked = {};
    const off = connection !== "live" || Boolean(asked.step);
    for (const button of all("[data-step]")) [button.disabled, button.hidden] = [off, !run.steps.includes(button.dataset.step)];
    for (const button of all("[data-again]")) button.disabled = off || why({ ...state, planError: null }) !== null;
    $("compare-runs").disabled = !other(state);
    $("use-dwell").hidden = !run.result?.suggestion;
    $("use-dwell").classList.toggle("primary", !doubtful(run));
    $("afresh").hidden = phase(state) === "stopped" && resumable(run); // there it is carried on
    $("certificate").classList.toggle("primary", !doubtful(run) && !run.result?.suggestion);
    $("again").classList.toggle("primary", doubtful(run)); // of a north that is not to be used no certificate is wanted
    for (const link of all("[data-get]")) link.href = `/api/v1/runs/${run.run_id}/${link.dataset.get}`;
    const usual = { running: resumable(run) ? "say.keep" : "say.kept", paused: "say.paused" }[phase(state)] ?? "";
    const said = off ? (asked.step ? `asked.${asked.step}` : "The service cannot be reached.") : usual;
    for (const note of all(".said")) write(note, asked.refused ?? t(said));
    if (SHAPES[run.state]) showMessage(state);
  }
  store.on(["run", "runs", "rig", "connection", "visits", "estimates", "units"], show);
  keepFocus(store);
}

// A button goes away with the state that it belongs to: who used it by keyboard finds the next one in hand.
function keepFocus(store) {
  let held = null;
  let before = "";
  for (const kind of ["focusin", "pointerdown"]) addEventListener(kind, ({ target }) => { held = target.closest("button, a"); });
  store.on("run", (state) => {
    const now = phase(state);
    const gone = held && (held.disabled || !held.checkVisibility());
    if (now !== before && gone) [...all("#actions :is(button, a), #message button")].find((next) => !next.disabled && next.checkVisibility())?.focus({ preventScroll: true });
    before = now;
  });
}

// What the service filled in of its own is of that day: it is asked for again.
const anew = ({ start, sensors, sample_period_s, ...plan }) => plan;

const other = ({ run, runs }) => runs.find((one) => one.run_id !== run.run_id && one.state === "completed" && one.kind === run.kind);

// Without a turning table nothing can be carried on: what the base did meanwhile is not known.
function showUnresumable(run, means, n) {
  const finds = run.kind === "alignment"; // a heading that was held is not held any more
  write($("means"), [n && t("means.samples"), finds && (means || t("means.none"))].filter(Boolean).join(" "));
  write($("what-to-do"), t(run.state === "failed" ? "do.afresh" : "do.aborted"));
}

// What happened, what it means for north, what to do.
function showMessage(state) {
  const { run, visits, units } = state;
  const planned = schedule(run);
  const n = measured(visits).length;
  const [what, more] = run.state === "failed" && run.error ? reason(run) : [t(`say.${run.state}`), ""];
  setIcon($("message"), SHAPES[run.state]);
  write($("what"), what);
  write($("what-more"), more);
  const known = north(state)?.azimuth_sigma_deg;
  const predicted = run.prediction?.azimuth_sigma_deg;
  const [u, v] = [plusMinus(known, units), plusMinus(predicted, units)];
  const means = t(!known ? "means.nothing" : predicted && u !== v ? "means.instead" : "means.known", { u, v });
  if (!resumable(run)) return showUnresumable(run, known && means, n);
  write($("means"), n ? `${t("means.kept", { n, all: planned.length })} ${means}` : t("means.none"));
  write($("what-to-do"), t(n || run.state === "aborted" ? `do.${run.state}` : "do.empty"));
  write($("resume-at"), t("Resume at position {n}", place(planned, n)));
}
