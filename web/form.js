// A new run of any kind: what it would take and give is said before it is begun.

import { post, startRun } from "./api.js";
import { $, all, fill, h, icon, write } from "./dom.js";
import { azimuth, dayTime, duration, plusMinus, sentence } from "./format.js";
import { t } from "./i18n.js";
import { leftS, phase, waiting } from "./run.js";

const QUIET_MS = 200; // typing has paused
const WORDS = { // what the button does, and what is new
  "north-seek": ["Find north", "New north-seek"], alignment: ["Align", "New alignment"], "heading-hold": ["Hold heading", "New heading hold"], noise: ["Record noise", "New noise record"],
};
const FILTERED = ["quest", "triad", "optimized-triad"]; // these have a low-pass that can be warmed
const form = $("seek");
const fieldsOf = (kind) => form.querySelector(`.fields[data-kind=${kind}]`);
const inputsOf = (kind) => [...fieldsOf(kind).querySelectorAll("[name]")];
const shown = (value) => Number(value.toPrecision(3));
let predictSoon;

/** Choose a kind and fill its form, `values` by field; the reader begins the run. */
export function prepare(kind, values, store) {
  store.set({ kind });
  for (const [name, value] of Object.entries(values)) {
    const input = inputsOf(kind).find((one) => one.name === name);
    if (input.tagName === "SELECT" && ![...input.options].some((option) => option.value === value)) input.append(h("option", { value }, value));
    input.value = value;
  }
  $("new").classList.add("open");
  for (const button of [$("find"), $("first")]) if (button.checkVisibility()) button.focus();
  predictSoon(0);
}

export function mount(store) {
  let timer = 0;
  let asked = 0;
  let starting = false;
  const kind = () => store.state.kind;

  async function predict() {
    const turn = ++asked;
    const answer = await post("/plans", plan(kind())).then((prediction) => ({ prediction, planError: null }), (planError) => ({ planError }));
    if (answer.planError && store.state.prediction?.plan.kind !== kind()) answer.prediction = null; // another kind's says nothing of this one
    if (turn === asked) store.set(answer);
  }

  predictSoon = (quiet_ms) => {
    clearTimeout(timer);
    timer = setTimeout(predict, quiet_ms);
    $("prediction").className = "old";
  };
  $("kinds").addEventListener("change", ({ target }) => {
    store.set({ kind: target.value, planError: null });
    predictSoon(0);
  });
  form.addEventListener("input", () => {
    showHemisphere();
    predictSoon(QUIET_MS);
  });
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    if (starting || why(store.state)) return;
    starting = true;
    await startRun(plan(kind()), store).catch((planError) => store.set({ planError }));
    starting = false;
  });
  $("change").addEventListener("click", ({ target }) => target.setAttribute("aria-expanded", $("new").classList.toggle("open")));

  let known = "";
  store.on("rig", ({ rig }) => {
    const now = rig?.devices.length ? rig.site.latitude_deg.toFixed(3) : "";
    if (now === known) return;
    known = now;
    if (!now) return;
    if (rig.devices.some(({ driver }) => driver === "fixed")) store.set({ kind: "alignment" }); // without a table it seeks no north
    for (const input of form.querySelectorAll("[name=latitude_deg]")) input.defaultValue = now; // stands in the field until somebody writes another
    showHemisphere();
    predict();
  });
  store.on("kind", showKind);
  store.on(["runs", "rig"], showHeadings);
  store.on(["prediction", "rig"], showPrediction);
  store.on(["planError", "kind"], showErrors);
  store.on(["rig", "run", "runs", "connection", "planError", "progress", "prediction", "kind"], showWhy);
  setInterval(() => showWhy(store.state), 1000);
}

function showKind({ kind }) {
  for (const fields of all(".fields")) fields.hidden = fields.dataset.kind !== kind;
  for (const radio of all("#kinds input")) radio.checked = radio.value === kind;
  const [does, what] = WORDS[kind];
  for (const [element, key] of [[$("find"), does], [$("first"), does], [$("new-label").firstChild, what]]) {
    element.dataset.t = key;
    write(element, t(key));
  }
}

// The runs of this rig whose heading can be held; the service takes the newest where none is chosen.
function showHeadings({ runs, rig, lang }) {
  const found = runs.filter((run) => ["north-seek", "alignment"].includes(run.kind) && run.state === "completed" && run.rig_name === rig?.name);
  const select = $("hold-from_run");
  const { value } = select;
  fill(select, lang + found.map((run) => run.run_id), () => [
    h("option", { value: "" }, t("the newest")),
    ...found.map((run) => h("option", { value: run.run_id }, `${dayTime(run.created)} · ${azimuth(run.azimuth_deg, run.azimuth_sigma_deg).value}°`)),
  ]);
  if ([...select.options].some((option) => option.value === value)) select.value = value;
}

// South is negative, and "-33.9° N" would be read as north.
function showHemisphere() {
  for (const input of form.querySelectorAll("[name=latitude_deg]")) write(input.nextElementSibling, /^\s*[-−]/.test(input.value) ? t("° (S)") : "° N");
  $("warm").hidden = !FILTERED.includes($("align-method").value);
}

// What the fields say, as the service wants it; what is no number goes as it is, for the service to refuse.
const numeral = (text) => Number(text.replace(",", ".").replace("−", "-"));

function plan(kind) {
  const number = (text) => (text.trim() === "" ? null : Number.isNaN(numeral(text)) ? text : numeral(text));
  const inputs = inputsOf(kind).filter((input) => !input.closest(".field").hidden);
  const said = Object.fromEntries(inputs.map(({ name, tagName, value, defaultValue }) =>
    [name, tagName === "SELECT" ? value || null : name === "latitude_deg" && value === defaultValue ? null : number(value)]));
  if (said.target_sigma_deg > 0) said.target_sigma_deg /= 2;
  return { kind, ...said };
}

function showPrediction({ prediction, rig }) {
  if (!prediction) return ["will-take", "will-give"].forEach((id) => write($(id), "–"));
  const { kind, positions, order, target_sigma_deg } = prediction.plan;
  $("prediction").className = "";
  write($("will-take"), duration(prediction.duration_s / (rig?.speed || 1)));
  write($("will-give"), plusMinus(prediction.azimuth_sigma_deg));
  $("giving").hidden = prediction.azimuth_sigma_deg == null;
  fill($("warnings"), prediction.warnings, () => prediction.warnings.map((words) => h("li", {}, icon("warn"), h("span", { lang: "en" }, words))));
  if (kind !== "north-seek") return write($("new-summary").firstChild, `${t(kind)} · ${duration(prediction.duration_s)}`);
  const dwell = shown(prediction.plan.dwell_s);
  $("dwell_s").disabled = target_sigma_deg !== null; // the target chooses it
  if ($("dwell_s").disabled) $("dwell_s").value = dwell;
  write($("new-summary").firstChild, t("{n} positions · {dwell} s · {order}", { n: positions, dwell, order: $("order").querySelector(`[value=${order}]`).textContent }));
}

const errorOf = (input, planError) => planError?.errors?.find(({ field }) => field.split(".").at(-1) === input.name);

// Each refusal beside its field.
function showErrors({ planError, kind }) {
  for (const input of inputsOf(kind)) {
    const error = errorOf(input, planError);
    write($(input.getAttribute("aria-describedby")), error?.message ?? "");
    input.setAttribute("aria-invalid", Boolean(error));
    if (!error) continue;
    $("new").classList.add("open");
    const fold = input.closest("details");
    if (fold) fold.open = true;
  }
}

/** Why no run can start now, in words; null where one can. */
export function why(state) {
  const { connection, rig, planError, kind } = state;
  if (connection === "lost") return t("The service cannot be reached.");
  if (!rig) return t("state.connecting");
  if (rig.state === "starting") return t("The rig is starting.");
  if (rig.state === "offline") return t("The rig is offline.");
  if (rig.database?.ok === false) return t("trouble.database");
  if (rig.run_id || ["running", "paused"].includes(phase(state))) {
    const left_s = leftS(state);
    return t("One run at a time.") + (left_s === null ? "" : ` ${t("Ready in {time}.", { time: duration(left_s) })}`);
  }
  if (waiting(state)) return t("Resume or end the stopped run first.");
  if (planError?.status === 422) return inputsOf(kind).some((input) => errorOf(input, planError)) ? t("Mend the marked field first.") : sentence(planError.message);
  return null;
}

function showWhy(state) {
  const reason = why(state);
  const { run, prediction, planError, kind } = state;
  $("find").disabled = $("first").disabled = reason !== null;
  const same = run?.kind === kind && prediction?.plan.kind === kind && inputsOf(kind).every(({ name }) => run.plan[name] === prediction.plan[name]);
  write($("find-why"), reason ?? planError?.message ?? (same ? t("Same plan as the run shown.") : ""));
  const left_s = leftS(state);
  write($("new-ready"), left_s === null ? "" : t("ready in {time}", { time: duration(left_s) }));
}
