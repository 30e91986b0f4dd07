// A new north-seek: what it would take and give is said before it is begun.

import { post, startRun } from "./api.js";
import { $, fill, h, icon, write } from "./dom.js";
import { duration, plusMinus } from "./format.js";
import { t } from "./i18n.js";
import { leftS, phase, waiting } from "./run.js";

const QUIET_MS = 200; // typing has paused
const form = $("seek");
const inputs = [...form.querySelectorAll("[name]")];

export function mount(store) {
  let timer = 0;
  let asked = 0;
  let starting = false;

  async function predict() {
    const turn = ++asked;
    const answer = await post("/plans", plan()).then((prediction) => ({ prediction, planError: null }), (planError) => ({ planError }));
    if (turn === asked) store.set(answer);
  }

  form.addEventListener("input", () => {
    showHemisphere();
    clearTimeout(timer);
    timer = setTimeout(predict, QUIET_MS);
    $("prediction").className = "old";
  });
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    if (starting || why(store.state)) return;
    starting = true;
    await startRun(plan(), store).catch((planError) => store.set({ planError }));
    starting = false;
  });
  $("change").addEventListener("click", ({ target }) => target.setAttribute("aria-expanded", $("new").classList.toggle("open")));

  let known = "";
  store.on("rig", ({ rig }) => {
    const now = rig?.devices.length ? rig.site.latitude_deg.toFixed(3) : "";
    if (now === known) return;
    known = now;
    if (!now) return;
    form.latitude_deg.defaultValue = now; // stands in the field until somebody writes another
    showHemisphere();
    predict();
  });
  store.on(["prediction", "rig"], showPrediction);
  store.on("planError", showErrors);
  store.on(["rig", "run", "runs", "connection", "planError", "progress", "prediction"], showWhy);
  setInterval(() => showWhy(store.state), 1000);
}

// South is negative, and "-33.9° N" would be read as north.
function showHemisphere() {
  write($("hemisphere"), /^\s*[-−]/.test(form.latitude_deg.value) ? t("° (S)") : "° N");
}

// What the fields say, as the service wants it; what is no number goes as it is, for the service to refuse.
const numeral = (text) => Number(text.replace(",", ".").replace("−", "-"));

function plan() {
  const number = (text) => (text.trim() === "" ? null : Number.isNaN(numeral(text)) ? text : numeral(text));
  const said = Object.fromEntries(inputs.map(({ name, value }) => [name, name === "order" ? value : number(value)]));
  if (form.latitude_deg.value === form.latitude_deg.defaultValue) said.latitude_deg = null;
  if (said.target_sigma_deg > 0) said.target_sigma_deg /= 2;
  return { kind: "north-seek", ...said };
}

function showPrediction({ prediction, rig }) {
  if (!prediction) return;
  const { positions, dwell_s, order, target_sigma_deg } = prediction.plan;
  const dwell = Number(dwell_s.toPrecision(3));
  $("prediction").className = "";
  write($("will-take"), duration(prediction.duration_s / (rig?.speed || 1)));
  write($("will-give"), plusMinus(prediction.azimuth_sigma_deg));
  fill($("warnings"), prediction.warnings, () => prediction.warnings.map((words) => h("li", {}, icon("warn"), h("span", { lang: "en" }, words))));
  form.dwell_s.disabled = target_sigma_deg !== null; // the target chooses it
  if (form.dwell_s.disabled) form.dwell_s.value = dwell;
  write($("new-summary").firstChild, t("{n} positions · {dwell} s · {order}", { n: positions, dwell, order: form.order.querySelector(`[value=${order}]`).textContent }));
}

// Each refusal beside its field.
function showErrors({ planError }) {
  const errors = planError?.errors ?? [];
  for (const input of inputs) {
    const error = errors.find(({ field }) => field.split(".").at(-1) === input.name);
    write($(`${input.name}-error`), error?.message ?? "");
    input.setAttribute("aria-invalid", Boolean(error));
    if (error && $("more").contains(input)) $("more").open = true;
    if (error) $("new").classList.add("open");
  }
}

/** Why no run can start now, in words; null where one can. */
export function why(state) {
  const { connection, rig, planError } = state;
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
  if (planError?.status === 422) return planError.errors ? t("Mend the marked field first.") : planError.message;
  return null;
}

function showWhy(state) {
  const reason = why(state);
  const { run, prediction, planError } = state;
  $("find").disabled = $("first").disabled = reason !== null;
  const same = run && prediction && inputs.every(({ name }) => run.plan[name] === prediction.plan[name]);
  write($("find-why"), reason ?? planError?.message ?? (same ? t("Same plan as the run shown.") : ""));
  const left_s = leftS(state);
  write($("new-ready"), left_s === null ? "" : t("ready in {time}", { time: duration(left_s) }));
}
