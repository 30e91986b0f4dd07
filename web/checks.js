// What speaks for the result and what against it: a shape, a word and the number behind it.

import { $, fill, h, icon } from "./dom.js";
import { count, fine, fixed, near } from "./format.js";
import { t } from "./i18n.js";
import { reduce } from "./reduce.js";
import { ENDED, newest, reason, resumable } from "./run.js";

const ALWAYS = ["residuals", "earth rate", "tilt", "drift", "lost samples"];
const RESULT = ["solvers", "table"]; // named beside them once there is a result
const STATES = { fail: ["stopped", "red", "failed"], warn: ["warn", "orange", "attention"], pass: ["pass", "", "passed"], unknown: ["unknown", "quiet", "not known yet"] };

const found = (pattern, text, ...names) => Object.fromEntries(names.map((name, k) => [name, pattern.exec(text)[k + 1].replace("-", "−")]));
const noise = (fit, passed) => [passed ? "random, χ² {chi2} for {dof}" : "not random, χ² {chi2} for {dof}", { chi2: fit.chi2.toFixed(1), dof: fit.dof }];
const mean = (rows) => rows.reduce((sum, row) => sum + row.residual, 0) / rows.length;
const solversApart = ({ solutions: { coordinate_transform: one, vector: other } }) => Math.abs(near(one.azimuth_deg - other.azimuth_deg, 0));

// Each check's sentence as [key, values], from the numbers; what throws for want of a number is said by its word alone.
const SENTENCES = {
  residuals: ({ latest, passed }) => noise(latest.gyro_fit, passed),
  "accelerometer residuals": ({ latest, passed }) => noise(latest.accelerometer_fit, passed),
  "earth rate"({ latest: { earth_rate: rate }, detail }) {
    const [, measured, expected] = rate ? [0, rate.horizontal_measured_deg_h, rate.horizontal_expected_deg_h] : /([\d.]+) deg\/h, expected ([\d.]+)/.exec(detail);
    return ["{measured} °/h, expected {expected}", { measured: (+measured).toFixed(3), expected: (+expected).toFixed(3) }];
  },
  tilt: ({ latest, passed }) => [passed ? "{deg}°, corrected for" : "{deg}°, corrected for, but large: level it", { deg: latest.tilt.epsilon_deg.toFixed(2) }],
  drift({ latest, state }) {
    const slope = latest.segments[0].drift_deg_h_h;
    if (slope != null) return ["{slope} °/h per h, fitted", { slope: fixed(slope, 3) }];
    const { rows } = reduce(state);
    const [out, back] = ["out", "back"].map((way) => rows.filter((row) => row.direction === way));
    const u = 2 * latest.gyro_fit.residual_sigma_deg_h * Math.sqrt(1 / out.length + 1 / back.length);
    return back.length && ["out to back {step} ±{u} °/h", { step: fixed(mean(back) - mean(out), 3), u: u.toFixed(3) }];
  },
  outliers: ({ latest: { left_out: out } }) => out.length && ["left out: {n}", { n: new Set(out.map(({ visit }) => visit)).size }],
  solvers: ({ latest }) => ["agree to {deg}°", { deg: fine(Math.max(1e-6, solversApart(latest)), 6) }],
  table({ state: { visits } }) {
    const off = visits.flatMap((v, k) => (k && v.turned_deg != null && v.segment === visits[k - 1].segment ? Math.abs(v.turned_deg - v.angle_deg + visits[k - 1].angle_deg) : []));
    return off.length && ["the gyro saw it turn, to {deg}°", { deg: Math.max(...off).toFixed(3) }];
  },
  "lost samples"({ state: { visits } }) {
    const [came, lost] = ["samples", "lost"].map((key) => visits.reduce((sum, v) => sum + v[key], 0));
    return ["{came} of {all}", { came: count(came), all: count(came + lost) }];
  },
};

// Of a kind without a turning table: its own numbers, out of the service's sentence.
Object.assign(SENTENCES, {
  gravity: ({ detail }) => ["{mg} mg off local gravity", found(/([-+][\d.]+) mg off/, detail, "mg")],
  sway: ({ detail }) => ["{sway}′ of the heading, the sensors {others}′", found(/makes ([\d.]+)'.*sensors ([\d.]+)'/, detail, "sway", "others")],
  "gyro bias": ({ detail, state }) => (state.run.kind === "alignment" ? ["may turn the heading by {deg}°", found(/by ([\d.]+) deg/, detail, "deg")] : ["{rate} °/h at rest", found(/bias was ([\d.]+) deg/, detail, "rate")]),
  gaps: ({ latest }) => ["began anew {restarts} times, {bridged} samples bridged", { restarts: latest.restarts, bridged: count(latest.bridged_samples) }],
  stillness: ({ detail }) => ["{mg} mg from beginning to end", found(/by ([\d.]+) mg/, detail, "mg")],
});

function judge(state) {
  const { run } = state;
  const latest = newest(state);
  const checks = [...(latest?.checks ?? [])];
  const add = (name, status, detail, words) => checks.push({ name, status, detail, words });
  if (latest?.solutions) add("solvers", solversApart(latest) < latest.azimuth_sigma_deg / 10 ? "pass" : "warn", t("solvers.detail"));
  for (const name of always(run)) if (!checks.some((check) => check.name === name)) add(name, "unknown", "", name === "drift" && run ? t("known after the way back") : "");
  if (run?.state === "failed") add("run", "fail", run.error, reason(run)[0]);
  return checks.map((check) => ({ ...check, words: check.words || sentence(check, { ...check, latest, state, passed: check.status === "pass" }) }));
}

const always = (run) => (!run || run.kind === "north-seek" ? ALWAYS : []);

function sentence({ name, status }, facts) {
  if (status === "unknown") return "–";
  try {
    return t(...SENTENCES[name](facts));
  } catch {
    return t(STATES[status][2]);
  }
}

export function mount(store) {
  const [head, list, rest, summary] = [h("h2"), h("ul.checks"), h("ul.checks"), h("summary")];
  const folded = h("details.folded", {}, summary, rest);
  $("checks").append(head, list, folded);
  store.on(["run", "visits", "estimates"], (state) => {
    const { run, visits } = state;
    const when = !run || run.result || !resumable(run) ? "" : ENDED.includes(run.state) ? t("on {n} visits", { n: visits.length }) : t("so far");
    const order = ["run", ...ALWAYS, ...RESULT];
    const first = ({ name, status }) => ["warn", "fail"].includes(status) || ALWAYS.includes(name) || run?.kind !== "north-seek" || (run?.result && order.includes(name));
    const checks = judge(state).sort((a, b) => (b.status === "fail") - (a.status === "fail") || order.indexOf(a.name) - order.indexOf(b.name));
    const others = checks.filter((check) => !first(check));
    fill(head, t("Checks") + when, () => [t("Checks"), " ", h("small", {}, when)]);
    show(list, checks.filter(first));
    show(rest, others);
    $("checks").hidden = !checks.length;
    folded.hidden = !others.length;
    summary.textContent = t("{n} more, all passed", { n: others.length });
  });
}

// What the reader unfolded stays unfolded while the numbers change.
function show(list, checks) {
  const open = [...list.querySelectorAll("[open]")].map((details) => details.dataset.name);
  fill(list, JSON.stringify(checks) + t("passed"), () => checks.map(({ name, status, words, detail }) => {
    const [shape, colour, word] = STATES[status];
    const line = [icon(shape, colour), h("b", {}, t(name)), h("span", { title: words }, h("span.unseen", {}, `${t(word)}: `), words)];
    return h("li", {}, detail ? h("details", { "data-name": name, open: open.includes(name) }, h("summary", {}, ...line), h("p", {}, detail)) : h("div", {}, ...line));
  }));
}
