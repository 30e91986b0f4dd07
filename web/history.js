// Every run on record, newest first: filter them, look at one, choose some to compare.

import { get, openRun } from "./api.js";
import { $, fill, h, icon, write } from "./dom.js";
import { azimuth, dayTime } from "./format.js";
import { t } from "./i18n.js";
import { live, reason } from "./run.js";
import { columns, titled } from "./tables.js";

const CHOICES = { kind: ["north-seek", "alignment", "noise", "heading-hold"], state: ["running", "paused", "completed", "failed", "aborted", "interrupted"], rig: [] };
const SHAPES = { failed: ["stopped", "red"], interrupted: ["warn", "orange"], aborted: ["ended", ""], paused: ["paused", "orange"], completed: ["pass", ""] };
const PAGE = 50;

// [shape, colour, words]
function outcome(run) {
  const { state, checks, attention, progress } = run;
  if (state !== "completed") return [...(SHAPES[state] ?? ["measuring", "blue"]), state === "failed" && run.error ? reason(run)[0] : `${t(state)} · ${Math.round(100 * progress)} %`];
  if (run.figure && !checks?.fail && !checks?.warn) return [...SHAPES.completed, run.figure.replace("deg/sqrt(h)", "°/√h")];
  const words = checks ? [t("{n} passed", { n: checks.pass }), ...attention.map((name) => t(name))].join(t(", ")) : t(state);
  return [...(checks?.fail ? SHAPES.failed : checks?.warn ? ["warn", "orange"] : SHAPES.completed), words];
}

const planned = ({ positions, dwell_s, duration_s }) => [positions, dwell_s ?? duration_s].filter(Boolean).map((x) => Number(x.toPrecision(3))).join(" × ") + " s";

export function mount(store) {
  const asked = { kind: "", state: "", rig: "" };
  const page = { runs: null, cursor: null }; // fetched here: older runs, or those of the filter
  const selects = Object.keys(asked).map((name) => h("select", { name, onchange: ({ target }) => { asked[name] = target.value; page.runs = page.cursor = null; filtered() ? load() : show(store.state); } }));
  const rows = new Map();
  const [thead, tbody] = [h("thead"), h("tbody")];
  const table = h("table.rows.history", {}, thead, tbody);
  const more = h("button.link", { type: "button", onclick: () => load(page.cursor ?? undefined) });
  const none = h("p.note");
  const said = h("p.error", { role: "alert" });
  const scroll = h("div.scroll", { tabindex: 0, role: "region" }, table, more, none);
  const head = titled("", "");
  head.lastChild.before(...selects);
  $("history").append(head, said, scroll);

  const filtered = () => Object.values(asked).some(Boolean);

  async function load(cursor) {
    try {
      // Without a filter the newest are the store's own, so "more" begins where they end.
      const from = cursor ?? (filtered() ? "" : (await get(`/runs?limit=${PAGE}`)).next_cursor ?? "");
      const wanted = Object.entries({ ...asked, limit: PAGE, cursor: from }).filter(([, value]) => value);
      const { runs, next_cursor } = await get(`/runs?${new URLSearchParams(wanted)}`);
      Object.assign(page, { runs: cursor ? [...page.runs, ...runs] : runs, cursor: next_cursor });
      write(said, "");
    } catch (problem) {
      write(said, problem.message);
    }
    show(store.state);
  }

  function listed(state) {
    const newest = live(state);
    const known = new Map(newest.map((run) => [run.run_id, run]));
    const fetched = (page.runs ?? []).map((run) => known.get(run.run_id) ?? run);
    return filtered() ? fetched : [...newest, ...fetched.filter((run) => !known.has(run.run_id))];
  }

  // A row is kept: focus stays where it is while the numbers change.
  function rowOf(id) {
    const choose = ({ target }) => store.set({ compare: target.checked ? [...store.state.compare, id] : store.state.compare.filter((other) => other !== id) });
    const open = () => openRun(id, store).catch((problem) => write(said, problem.message));
    const tick = h("input", { type: "checkbox", onchange: choose, onclick: (event) => event.stopPropagation() });
    const when = h("button.link", { type: "button" });
    return { tick, when, tr: h("tr", { onclick: open }, ...[tick, when, ...Array(5).fill("")].map((cell) => h("td", {}, cell))) };
  }

  function update({ tick, when, tr }, run, { run: shown, units, compare }) {
    const known = run.azimuth_deg != null && run.azimuth_sigma_deg < 60 && azimuth(run.azimuth_deg, run.azimuth_sigma_deg, units);
    const [shape, colour, words] = outcome(run);
    const now = run.run_id === shown?.run_id;
    tick.hidden = run.kind === "noise"; // there is no azimuth to compare
    tick.checked = compare.includes(run.run_id);
    write(when, dayTime(run.created));
    tick.setAttribute("aria-label", `${t("compare")} ${when.textContent}`);
    when.setAttribute("aria-current", now);
    tr.classList.toggle("shown", now);
    [t(run.kind), planned(run.plan), known ? known.value + known.sign : "", known ? known.sigma + known.sign : ""].forEach((text, k) => write(tr.cells[k + 2], text));
    fill(tr.cells[6], shape + words, () => [h("span", { title: words }, icon(shape, colour), " ", words)]);
    return tr;
  }

  function show(state) {
    const { rig, lang, total } = state;
    const runs = listed(state);
    const rigs = [...new Set([rig?.name, ...runs.map((run) => run.rig_name)])].filter(Boolean);
    write(head.firstChild, t("History"));
    write(head.lastChild, total ? t(total === 1 ? "{n} run" : "{n} runs", { n: total }) : "");
    scroll.setAttribute("aria-label", t("History"));
    for (const select of selects) {
      const { name } = select;
      fill(select, lang + rigs, () => ["", ...(name === "rig" ? rigs : CHOICES[name])].map((value) => h("option", { value, selected: asked[name] === value }, t(value || `every ${name}`))));
      select.setAttribute("aria-label", t(name));
    }
    selects[2].hidden = rigs.length < 2 && !asked.rig;
    fill(thead, lang, () => [columns(...["when", "kind", "plan", "azimuth", "±2σ", "outcome"].map((word) => t(word)))]);
    const trs = runs.map((run) => {
      if (!rows.has(run.run_id)) rows.set(run.run_id, rowOf(run.run_id));
      return update(rows.get(run.run_id), run, state);
    });
    fill(tbody, runs.map((run) => run.run_id).join(), () => trs);
    write(more, t("more"));
    more.hidden = page.runs ? !page.cursor : state.runs.length < PAGE;
    write(none, runs.length ? "" : t(filtered() ? "No such run." : "No run yet."));
    table.hidden = !runs.length;
  }

  store.on(["runs", "run", "estimates", "compare", "units", "total", "rig"], show);
}
