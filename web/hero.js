// What runs, at a glance: north so far, the dial, the state, the time left.

import { showGyro, showNorth as draw } from "./dial.js";
import { $, all, fill, h, setIcon, write } from "./dom.js";
import { azimuth, clock, digits, duration, interval, plusMinus, sentence } from "./format.js";
import { t } from "./i18n.js";
import { ENDED, doubtful, exaggeration, kindOf, leftS, measured, newest, north, phase, place, planned, schedule } from "./run.js";

const MOST_CELLS = 60; // more would be narrower than can be told apart
const LATE_S = 3;
const NUMBERS = "No One Two Three Four Five Six Seven Eight Nine Ten Eleven Twelve".split(" ");
const LOOKS = {
  queued: "measuring blue", running: "measuring blue", paused: "paused orange", completed: "done blue", failed: "stopped red",
  interrupted: "warn orange", aborted: "ended quiet", doubtful: "stopped red", lost: "unknown orange", connecting: "unknown quiet",
  ready: "live blue", busy: "measuring blue", starting: "unknown quiet", offline: "stopped red",
};

export function mount(store) {
  store.on(["run", "estimates", "units", "loaded", "kind"], (state) => {
    document.body.dataset.phase = phase(state);
    document.body.dataset.state = state.run?.state ?? "";
    document.body.dataset.kind = kindOf(state);
    showNorth(state);
  });
  store.on(["run", "visits", "estimates", "units", "prediction"], showDial);
  store.on(["run", "rig", "estimates"], (state) => {
    showGyro((north(state)?.azimuth_deg ?? 0) - state.rig?.table?.angle_deg, state.run?.state === "failed");
  });
  store.on(["run", "visits", "progress", "connection", "loaded", "rig"], showState);
  store.on(["run", "visits", "progress"], showCells);
  store.on("run", showVerdict);
  store.on(["run", "prediction", "rig", "kind", "planError"], showPromise);
  setInterval(() => showState(store.state), 1000);
}

const text = ({ value, sign }) => value + sign;

function showNorth(state) {
  const { run, units } = state;
  if (kindOf(state) === "noise") return showWalk(state);
  const known = north(state);
  const offset = run?.site?.reference_offset_deg;
  const label = t(!run || run.state === "completed" ? "North" : run.kind === "heading-hold" ? "North, held" : "North so far");
  const line = offset && known && text(azimuth((known.azimuth_deg + offset + 360) % 360, known.azimuth_sigma_deg, units));
  write($("north-label"), label);
  write($("reference"), line ? `${t("reference line")} ${line}` : "");
  for (const button of all("[data-unit]")) button.setAttribute("aria-pressed", button.dataset.unit === units);
  const shown = known ? azimuth(known.azimuth_deg, known.azimuth_sigma_deg, units) : { value: unknown(state), sign: "", sigma: "" };
  const long = units === "dms" ? "longer" : (shown.value + shown.sigma + shown.sign).length > 14 ? "long" : "";
  showFigure(shown.value, shown.sign === "°" ? "°" : "", shown.sigma && shown.sigma + shown.sign, `${known && !doubtful(run) ? "" : "unknown"} ${long}`);
  document.title = known ? `${text(shown)} · northfinder` : "northfinder";
}

const unknown = (state) => (phase(state) === "running" ? "…" : "–");

function showFigure(value, sign, beside, look) {
  $("azimuth").className = `figures ${look}`;
  write($("azimuth-value").firstChild, value);
  write($("azimuth-value").lastChild, sign);
  write($("azimuth-u"), beside);
  $("azimuth-sigma").hidden = !beside;
}

// A static record finds no north: its figure is how far the gyro's angle walks.
function showWalk(state) {
  const walk = newest(state)?.gyro.angle_random_walk_deg_sqrt_h;
  const seen = walk?.value != null;
  write($("north-label"), t("Angle random walk"));
  write($("reference"), seen ? `95 %: ${interval(walk)}` : "");
  showFigure(seen ? digits(walk.value) : unknown(state), "", seen ? "°/√h" : "", seen && !doubtful(state.run) ? "" : "unknown");
  document.title = "northfinder";
}

function showDial(state) {
  const { run, visits, units } = state;
  const known = north(state);
  const route = planned(state);
  const angles = [...new Set(route.map((visit) => visit.angle_deg))];
  const done = new Set(measured(visits).map((visit) => visit.angle_deg));
  const next = route[measured(visits).length]?.angle_deg;
  const turns = kindOf(state) === "north-seek";
  const factor = exaggeration(run?.prediction?.azimuth_sigma_deg ?? known?.azimuth_sigma_deg);
  const where = known && text(azimuth(known.azimuth_deg, known.azimuth_sigma_deg, units));
  draw({
    azimuthDeg: known?.azimuth_deg ?? null, sigmaDeg: known?.azimuth_sigma_deg ?? 0, factor, angles,
    states: angles.map((deg) => (done.has(deg) ? "on" : run?.state === "failed" && deg === next ? "bad" : "")),
    label: known ? t(turns ? "dial.known" : "dial.north", { north: where, done: done.size, all: angles.length }) : t("dial.unknown"),
    note: known ? t(turns ? "dial.note" : "dial.still", { factor }) : angles.length ? t(run ? "dial.mark" : "dial.planned") : "",
  });
}

function showState(state) {
  const name = stateName(state);
  const [shape, colour] = LOOKS[name].split(" ");
  const line = $("run-state");
  write(line.querySelector("b"), t(`state.${name}`));
  setIcon(line, shape);
  line.className = colour;
  write($("run-detail"), state.run && name !== "lost" ? details(state) : "");
  write($("announce"), t(`state.${name}`));
}

function stateName({ run, rig, connection, loaded }) {
  if (connection === "lost") return "lost";
  if (doubtful(run)) return "doubtful";
  return run?.state ?? ((loaded && rig?.state) || "connecting");
}

function details(state) {
  const { run, visits, progress } = state;
  const route = schedule(run);
  const turns = route.length > 0;
  const place_now = place(route, measured(visits).length);
  const at = turns && t(place_now.direction === "back" ? "position {n} of {of} back" : "position {n} of {of} outward", place_now);
  const time = ENDED.includes(run.state) && run.started && run.finished && duration((Date.parse(run.finished) - Date.parse(run.started)) / 1000);
  const left_s = leftS(state);
  const said = {
    queued: [],
    running: [progress && progress.phase !== "measuring" ? t(`phase.${resting(state) ? "resting" : progress.phase}`, { deg: Number(progress.angle_deg?.toFixed(2)) }) : at, left_s !== null && t(left_s < -LATE_S ? "longer than expected" : "{time} left", { time: duration(left_s) })],
    completed: [run.finished && clock(run.finished), time && t(turns ? "{n} visits in {time}" : "in {time}", { n: route.length, time })],
  }[run.state] ?? [at && t("at {place}", { place: at }), time && t("after {time}", { time })];
  return said.filter(Boolean).join(" · ");
}

// A heading hold measures the gyro's bias first, where the base can stand still.
const resting = ({ run, progress }) => progress.phase === "holding" && progress.progress * (run.plan.rest_s + run.plan.duration_s) < run.plan.rest_s;

function showCells({ run, visits, lang }) {
  if (run && run.kind !== "north-seek") return fill($("cells"), [run.run_id, run.state, run.progress, lang], () => (run.state === "completed" ? [] : [bar(run.progress, `${Math.floor(100 * run.progress)} %`)]));
  const route = run && run.state !== "completed" ? schedule(run) : [];
  const done = measured(visits).length;
  fill($("cells"), [run?.run_id, run?.state, done, route.length, lang], () =>
    ["out", "back"].map((direction) => leg(route, direction, done, run?.state === "failed")));
}

function leg(visits, direction, done, failed) {
  const at = [...visits.keys()].filter((k) => visits[k].direction === direction);
  if (!at.length) return null;
  const finished = at.filter((k) => k < done).length;
  const words = [`${t(direction)} `, h("b", {}, String(finished)), ` ${t("of {n}", { n: at.length })}`];
  if (at.length > MOST_CELLS) return bar(finished / at.length, ...words);
  const cells = at.map((k) => h("i", { class: k < done ? "on" : k > done ? "" : failed ? "bad" : "now" }));
  return h("div", {}, h("div.row", {}, ...cells), ...words);
}

const bar = (share, ...words) => h("div", {}, h("div.row.bar", {}, h("i.on", { style: `flex:0 0 ${100 * share}%` })), ...words);

function showVerdict({ run, lang }) {
  write($("verdict"), run?.state === "completed" && run.result ? [verdict(run.result.checks, lang), dwell(run.result)].filter(Boolean).join(" ") : "");
}

const dwell = ({ suggestion }) => suggestion && t("noise.dwell", { dwell: Number(suggestion.dwell_s.toPrecision(2)) });

// Before the first run: what the button will do, take and give; or why it cannot.
function showPromise({ run, kind, prediction, planError, rig }) {
  if (run) return;
  const promised = prediction?.plan.kind === kind ? prediction : null;
  const speed = rig?.speed || 1;
  write($("promise-time"), promised && !planError ? duration(promised.duration_s / speed) : "–");
  write($("promise-sigma"), planError ? "–" : plusMinus(promised?.azimuth_sigma_deg));
  $("promise-sigma").parentElement.hidden = kind === "noise";
  if (planError) return write($("promise-words"), sentence(planError.message));
  if (!promised) return;
  const { positions, dwell_s } = promised.plan;
  const words = t(`first.${kind}`, { n: positions, dwell: Number(dwell_s?.toPrecision(3)) });
  write($("promise-words"), speed === 1 ? words : `${words} ${t("say.speed", { speed })}`);
}

function verdict(checks, lang) {
  return ["pass", "warn", "fail"].map((status) => {
    const those = checks.filter((check) => check.status === status);
    const n = (lang === "en" && NUMBERS[those.length]) || those.length;
    return those.length ? t(`say.${status}${those.length > 1 ? "s" : ""}`, { n, names: those.map((check) => t(check.name)).join(t(", ")) }) : "";
  }).join(" ").trim();
}
