// The rig at rest and in motion: the table's angle, each device's light, and STOP.

import { post } from "./api.js";
import { $, setIcon, write } from "./dom.js";
import { count, fixed, latitude } from "./format.js";
import { t } from "./i18n.js";
import { phase } from "./run.js";

const LIGHTS = { ok: "live blue", silent: "warn orange", offline: "unknown orange", fault: "stopped red" };
const HOLD_MS = 1000; // a word that changes faster than this cannot be read
const STOP_DEADLINE_MS = 3000;
const TWICE_MS = 1000;

export function mount(store) {
  let turn = { at_ms: -HOLD_MS, word: "" };
  store.on(["rig", "run", "connection"], (state) => {
    const { table, run_id, devices } = state.rig ?? {};
    if (!devices) return;
    const now_ms = performance.now();
    if (table?.moving) turn = { at_ms: now_ms, word: table.homed && table.target_deg !== null ? t("turning to {deg}°", { deg: Number(table.target_deg.toFixed(2)) }) : t("homing") };
    showSite(state.rig);
    showMotion(state, (table?.moving || run_id) && now_ms - turn.at_ms < HOLD_MS && turn.word);
    for (const device of devices) showDevice(device, table);
  });
  mountStop(store);
}

function showSite({ name, site, simulated, speed }) {
  write($("site"), name);
  write($("latitude-shown"), latitude(site.latitude_deg));
  $("simulated").hidden = !simulated;
  write($("simulated"), t("simulated ×{speed}", { speed }));
}

function showMotion(state, turning) {
  const { table, run_id } = state.rig;
  const [word, look] = motion(state, turning);
  const [shape, colour] = look.split(" ");
  write($("table-angle"), table?.angle_deg == null ? "–" : `${table.angle_deg.toFixed(2)}°`);
  write($("table-state").querySelector("b"), word);
  setIcon($("table-state"), shape);
  $("table-state").className = colour;
  $("stop").classList.toggle("moves", Boolean(turning || (run_id && phase(state) !== "paused")));
}

function motion({ rig: { state, table, run_id }, run, connection }, turning) {
  if (connection === "lost") return [t("unknown"), "unknown orange"];
  if (!table || state === "offline") return [t("offline"), "stopped red"];
  if (turning) return [turning, "turning blue"];
  return run?.state === "failed" && !run_id ? [t("stopped"), "stopped red"] : [t("still"), "still quiet"];
}

function showDevice(device, table) {
  const row = document.querySelector(`[data-role="${device.role}"]`);
  const [, name, now, counts] = row.children;
  const [shape, colour] = LIGHTS[device.state].split(" ");
  const { frames, crc_errors, lost } = device.counters;
  setIcon(row, shape);
  row.className = colour;
  write(name.lastChild, device.identity?.model || device.driver);
  name.title = Object.values(device.identity ?? {}).join(" ");
  write(now, device.state === "ok" ? doing(device, table) : t(`device.${device.state}`));
  write(counts, device.detail ?? t("{frames} frames, {bad} bad, {lost} lost", { frames: count(frames), bad: count(crc_errors), lost: count(lost) }));
}

function doing({ role, rate_hz, reading, reading_unit, temperature_deg_c }, table) {
  const signal = reading == null ? null : `${fixed(reading, Math.abs(reading) < 1 ? 4 : 2)} ${reading_unit.replace("deg", "°")}`;
  return [
    role === "turntable" ? t(table?.homed ? "homed" : "not homed") : rate_hz && `${Math.round(rate_hz)} /s`,
    role === "turntable" ? null : signal,
    temperature_deg_c != null && `${temperature_deg_c.toFixed(1)} °C`,
  ].filter(Boolean).join(" · ");
}

// STOP answers the finger at once; what the table says follows.
function mountStop(store) {
  const button = $("stop");
  let escaped_ms = -TWICE_MS;

  async function stop() {
    button.classList.add("pressed");
    write($("stop-word"), t("STOPPING"));
    const refused = await post("/rig/stop", undefined, {}, STOP_DEADLINE_MS).then(() => null, (problem) => problem.message);
    store.set({ stopFailed: refused });
    button.classList.remove("pressed");
    write($("stop-word"), t("STOP"));
  }

  button.addEventListener("click", stop);
  addEventListener("keydown", (event) => {
    if (event.key !== "Escape" || event.defaultPrevented || event.repeat) return;
    if (event.timeStamp - escaped_ms < TWICE_MS) stop();
    escaped_ms = event.timeStamp;
  });
}
