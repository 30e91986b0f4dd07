// The rig at rest and in motion: the table's angle, each device's light, and STOP.

import { post } from "./api.js";
import { $, all, setIcon, write } from "./dom.js";
import { count, fixed, latitude } from "./format.js";
import { t } from "./i18n.js";
import { phase, resumable } from "./run.js";

const LIGHTS = { ok: "live blue", silent: "warn orange", offline: "unknown orange", fault: "stopped red" };
const HOLD_MS = 1000; // a word that changes faster than this cannot be read
const STOP_DEADLINE_MS = 3000;
const TWICE_MS = 1000;

export function mount(store) {
  let turned_ms = -HOLD_MS;
  let target_deg = null;
  store.on(["rig", "run", "progress", "connection"], (state) => {
    if (!state.rig) return;
    const { table, run_id, devices } = state.rig;
    const turns = table?.moving || table?.target_deg != null;
    if (turns) [turned_ms, target_deg] = [performance.now(), table.target_deg ?? target_deg];
    const soon = run_id && performance.now() - turned_ms < HOLD_MS; // between two short turns it is as good as turning
    showSite(state.rig);
    showMotion(state, table && (turns || soon) && turning(state, turns ? target_deg : state.progress?.angle_deg ?? target_deg));
    for (const row of all("#devices li")) showDevice(row, state.connection === "live" && devices.find(({ role }) => role === row.dataset.role), state.rig);
    if (run_id || turns || !table || state.connection !== "live") return;
    target_deg = null;
    if (state.stopFailed) store.set({ stopFailed: null }); // it stands: no STOP is missing any more
  });
  mountStop(store);
}

function showSite({ name, site, simulated, speed }) {
  write($("site"), name);
  write($("latitude-shown"), latitude(site.latitude_deg));
  $("simulated").hidden = !simulated;
  write($("simulated"), t("simulated ×{speed}", { speed }));
}

function showMotion(state, moves) {
  const { table, run_id } = state.rig;
  const [word, look] = motion(state, moves);
  const [shape, colour] = look.split(" ");
  $("motion").classList.toggle("old", state.connection === "lost");
  write($("table-angle"), table?.angle_deg == null ? "–" : `${table.angle_deg.toFixed(2)}°`);
  write($("table-state").querySelector("b"), word);
  setIcon($("table-state"), shape);
  $("table-state").className = colour;
  $("stop").classList.toggle("moves", Boolean(moves || (run_id && phase(state) !== "paused")));
}

function turning({ rig: { table }, progress }, target_deg) {
  if (!table.homed || progress?.phase === "homing") return t("homing");
  return target_deg === null ? t("turning") : t("turning to {deg}°", { deg: Number(target_deg.toFixed(2)) });
}

function motion({ rig: { state, table, run_id }, run, connection }, moves) {
  if (connection === "lost") return [t("unknown"), "unknown orange"];
  if (!table || state === "offline") return [t("offline"), "stopped red"];
  if (moves) return [moves, "turning blue"];
  return run?.state === "failed" && resumable(run) && !run_id ? [t("stopped"), "stopped red"] : [t("still"), "still quiet"];
}

// A device that nobody can be asked about is neither well nor ill; what is said of the whole rig is said once.
function showDevice(row, device, { table, detail }) {
  const [, name, now, counts] = row.children;
  const [shape, colour] = device ? LIGHTS[device.state].split(" ") : ["unknown", "quiet"];
  setIcon(row, shape);
  row.className = colour;
  write(now, !device ? t("unknown") : device.state === "ok" ? doing(device, table) : t(`device.${device.state}`));
  if (!device) return;
  const { frames, crc_errors, lost } = device.counters;
  write(name.lastChild, device.identity?.model || device.driver);
  name.title = Object.values(device.identity ?? {}).join(" ");
  write(counts, detail && device.detail === detail ? "" : device.detail ?? t("{frames} frames, {bad} bad, {lost} lost", { frames: count(frames), bad: count(crc_errors), lost: count(lost) }));
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
