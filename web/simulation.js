// The simulated world, its truth and its faults, to be changed while it runs. Hardware has none.

import { del, get, patch, post } from "./api.js";
import { $, h, write } from "./dom.js";
import { t } from "./i18n.js";

const FIELDS = {
  azimuth_deg: ["azimuth", "°"], pitch_deg: ["pitch", "°"], roll_deg: ["roll", "°"], gyro_noise_deg_sqrt_h: ["gyro noise", "°/√h"], gyro_bias_deg_h: ["gyro bias", "°/h"],
  gyro_drift_deg_h_h: ["gyro drift", "°/h²"], gyro_bias_instability_deg_h: ["bias instability", "°/h"], accel_noise_g_sqrt_hz: ["accelerometer noise", "g/√Hz"], base: ["base"],
  drop_per_byte: ["drop", "/byte"], corrupt_per_byte: ["corrupt", "/byte"], duplicate_per_byte: ["duplicate", "/byte"], repeat_per_burst: ["repeat", "/burst"], delay_s: ["delay", "s"],
  silent: ["silent"], unplugged: ["unplugged"], blocked_at_deg: ["blocked at", "°"], short_by_deg: ["short by", "°"], slipped_deg: ["slipped by", "°"], slip_per_move_deg: ["slip per move", "°"],
  frozen: ["frozen"], spikes_per_s: ["spikes", "/s"], spike_deg_s: ["spike size", "°/s"], limit_deg_s: ["rate limit", "°/s"], drift_deg_h2: ["drift from now", "°/h²"], curvature_deg_h3: ["curving drift", "°/h³"],
};

const BASES = { still: "stands still", nominal: "vehicle, light wind", "paper-like": "vehicle, rough" };

/** Fill the fold, now and whenever it opens again: others may have changed the world meanwhile. */
export function mount(store) {
  const panel = $("simulation-body");
  const said = h("p.error", { role: "alert" });
  const report = (problem) => write(said, problem.message);
  $("simulation").addEventListener("toggle", ({ target }) => target.open && load().catch(report));
  store.on("lang", () => load().catch(report));

  async function load() {
    const [truth, { faults }] = await Promise.all([get("/rig/simulation"), get("/rig/simulation/faults")]);
    const clear = () => del("/rig/simulation/faults").then(load).catch(report);
    const { id } = document.activeElement;
    write(said, "");
    panel.replaceChildren(
      h("p.note", {}, t("simulation.note")), group(t("Truth"), "truth", truth, (change) => patch("/rig/simulation", change)),
      ...Object.entries(faults).map(([device, its]) => group(t(`Faults: ${device}`), device, its, (change) => post("/rig/simulation/faults", { device, ...change }))),
      h("button", { id: "clear-faults", type: "button", onclick: clear }, t("Clear all faults")), said,
    );
    if (id) $(id)?.focus({ preventScroll: true });
  }

  const group = (legend, name, values, send) => h("fieldset", {}, h("legend", {}, legend), ...Object.keys(values).filter((key) => key in FIELDS).map((key) => field(`${name}-${key}`, key, values[key], send)));

  // Each value goes out when it is left; what the service refuses stands beside it.
  function field(id, key, value, send) {
    if (key === "base") return choice(id, value, send);
    const [word, unit] = FIELDS[key];
    const error = h("p.error", { id: `${id}-error`, role: "alert" });
    const change = async ({ target }) => {
      const typed = target.value.trim().replace("−", "-").replace(",", ".");
      const answer = await send({ [key]: unit ? (typed === "" ? null : Number.isNaN(+typed) ? typed : +typed) : target.checked }).then(() => null, (problem) => problem);
      target.setAttribute("aria-invalid", Boolean(answer));
      write(error, answer ? answer.errors?.[0]?.message ?? answer.message : "");
    };
    const kind = unit ? { inputmode: "decimal", autocomplete: "off", value: value ?? "" } : { type: "checkbox", checked: value };
    return labelled(id, t(word), h(unit ? "span.box" : "span", {}, h("input", { id, "aria-describedby": error.id, onchange: change, ...kind }), unit ? h("i", {}, t(unit)) : null), error);
  }

  // Where the bench stands: on the ground, or in a vehicle that rocks.
  function choice(id, value, send) {
    const options = Object.entries(BASES).map(([name, words]) => h("option", { value: name, selected: name === value }, t(words)));
    return labelled(id, t(FIELDS.base[0]), h("span.box", {}, h("select", { id, onchange: ({ target }) => send({ base: target.value }).catch(report) }, ...options)));
  }

  const labelled = (id, words, ...rest) => h("div.field", {}, h("label", { for: id }, words), ...rest);
}
