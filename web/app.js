// Opens the page: the store, the two streams, and every panel.

import * as actions from "./actions.js";
import * as banner from "./banner.js";
import * as form from "./form.js";
import * as hero from "./hero.js";
import * as rig from "./rig.js";
import { get, insist, loadRuns, onUnauthorized, openRig, openRun } from "./api.js";
import { $, all } from "./dom.js";
import { choose, speak } from "./i18n.js";
import { loadPlotly } from "./drawing.js";
import { ENDED, phase } from "./run.js";
import { createStore } from "./store.js";

const some = ({ run }) => run !== null;
const turning = ({ run }) => run?.kind === "north-seek";
const tracking = ({ run }) => ["alignment", "heading-hold"].includes(run?.kind);
const recording = ({ run }) => run?.kind === "noise";

// What the first look can do without: each loaded once there is something for it to show.
const PANELS = {
  budget: ({ run, prediction }) => run ?? prediction,
  fit: turning,
  track: tracking,
  allan: recording,
  checks: some,
  history: some,
  control: some,
  events: (state) => some(state) && phase(state) !== "completed",
  settle: (state) => turning(state) && ["running", "paused"].includes(phase(state)),
  sureness: tracking,
  figures: recording,
  result: (state) => turning(state) && state.run.result,
  attitude: (state) => tracking(state) && state.run.result,
  compare: ({ compare }) => compare.length > 1,
};

const store = createStore({ lang: speak() });
onUnauthorized(() => import("./session.js").then(({ askForToken }) => askForToken()));
for (const part of [rig, hero, actions, form, banner]) part.mount(store);
mountChoices();
let active; // the run that the rig is at
let last; // the one that it was at last: some begin and end between two words from the rig
await start();
store.on(["run", "prediction", "compare"], loadPanels);
store.on("prediction", ({ prediction }) => prediction && loadPlotly().catch(reportError));

function loadPanels(state) {
  for (const [name, isNeeded] of Object.entries(PANELS)) {
    if (!isNeeded(state)) continue;
    delete PANELS[name];
    load(name);
  }
}

async function load(name) {
  const panel = await insist(() => import(`./${name}.js`), store);
  panel.mount(store);
}

async function start() {
  await get("/rig").then((now) => store.set({ rig: now, connection: "live" }), () => store.set({ connection: "lost" }));
  await showNewest();
  openRig(store);
  store.on("rig", followTheRig);
}

// The active run, else the newest; without the records, again at the next word from the rig.
async function showNewest() {
  const { rig: now, loaded } = store.state;
  if (!now || loaded !== undefined) return;
  store.set({ loaded: false });
  try {
    await loadRuns(store);
    ({ run_id: active, last_run_id: last } = now);
    const id = active ?? store.state.runs[0]?.run_id;
    if (id) await openRun(id, store);
    store.set({ loaded: true, trouble: null });
  } catch (problem) {
    store.set({ loaded: undefined, trouble: problem.message });
  }
}

// A run that another page or program began or resumed is shown as soon as the rig says so.
function followTheRig({ rig: now, run, loaded }) {
  const id = now?.last_run_id;
  const begun = id && (id !== last || (now.run_id && !active));
  ({ run_id: active, last_run_id: last } = now ?? {});
  if (!loaded) showNewest();
  else if (begun && (run?.run_id !== id || ENDED.includes(run.state))) insist(() => id === last && openRun(id, store), store);
}

function mountChoices() {
  for (const button of all("[data-lang]")) {
    button.addEventListener("click", () => store.set({ lang: choose(button.dataset.lang) }));
    store.on("lang", ({ lang }) => button.setAttribute("aria-pressed", button.dataset.lang === lang));
  }
  for (const button of all("[data-unit]")) button.addEventListener("click", () => store.set({ units: button.dataset.unit }));
  store.on("rig", ({ rig: now }) => { $("simulation").hidden = !now?.simulated; });
  for (const fold of ["simulation", "studies"]) $(fold).addEventListener("toggle", () => load(fold), { once: true });
  $("simulation").addEventListener("toggle", ({ target }) => target.open && target.scrollIntoView());
}
