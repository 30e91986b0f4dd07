// What happened in this run, newest first.

import { $, fill, h, icon } from "./dom.js";
import { clock, count, fixed, plusMinus, sentence } from "./format.js";
import { t } from "./i18n.js";
import { schedule } from "./run.js";

const SHOWN = 40;
const SHAPES = { orange: "warn", red: "stopped" };

export function mount(store) {
  store.on(["events", "run"], ({ run, events, lang }) => {
    const begun = events.find(({ state }) => state === "running");
    const newest = events.slice(-SHOWN).reverse();
    fill($("event-list"), `${run?.run_id} ${events.length} ${lang}`, () => newest.map((event) => {
      const [text, colour = ""] = say(event, run, begun);
      const shape = SHAPES[colour] && icon(SHAPES[colour], colour);
      return h("li", { class: colour }, h("time", { datetime: event.time }, clock(event.time)), h("span", { title: text }, shape, text));
    }));
  });
}

function say(event, run, begun) {
  if (event === begun) return [t("event.begun")];
  if (event.kind === "state") return [t(`event.${event.state}`), { failed: "red", interrupted: "orange" }[event.state]];
  if (event.kind === "visit") return [visit(event, run), event.lost ? "orange" : ""];
  if (event.kind === "result" && event.azimuth_deg == null) return [t("result")];
  if (event.kind === "result") return [`${t("north")} ${event.azimuth_deg.toFixed(3)}° ${plusMinus(event.azimuth_sigma_deg)}`];
  return [sentence(event.message), event.kind === "error" ? "red" : "orange"];
}

function visit({ angle_deg, direction, gyro_mean_deg_h, samples, lost, repeats }, run) {
  if (run?.kind !== "north-seek") return t("{n} samples kept", { n: count(samples) }) + (lost ? t(", {n} lost", { n: lost }) : "");
  const of = schedule(run).filter((one) => one.direction === direction);
  const n = of.findIndex((one) => Math.abs(one.angle_deg - angle_deg) < 1e-6) + 1;
  const key = repeats == null ? "position {n}: {rate} °/h, {samples} samples" : "position {n} again: {rate} °/h, {samples} samples";
  return t(key, { n, rate: fixed(gyro_mean_deg_h, 3), samples: count(samples) }) + (lost ? t(", {n} lost", { n: lost }) : "");
}
