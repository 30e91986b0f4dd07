// Azimuth by run: is today's north the north of all days?

import { axis, azimuthAxis, createChart, heading, label, line, points } from "./charts.js";
import { $, h, write } from "./dom.js";
import { decimals, locale, near } from "./format.js";
import { t } from "./i18n.js";
import { doubtful, live } from "./run.js";

const RUN_PX = 22;
const LABEL_PX = 70;
const WIDE = 5; // an unfinished run shows once its whiskers are at most so many times the others'
const MARKS = { done: ["blue", "circle", 7], live: ["blue", "circle", 9], warn: ["orange", "triangle-up", 9], stopped: ["red", "square", 8] };

function markOf({ state, checks }) {
  if (["failed", "aborted", "interrupted"].includes(state) || checks?.fail) return "stopped";
  if (state !== "completed") return "live";
  return checks?.warn ? "warn" : "done";
}

// Mean, scatter and usual sigma of the completed runs, reckoned about one of them: 359.9 and 0.1 are neighbours.
function statistics(done) {
  if (!done.length) return null;
  const azimuths = done.map((run) => near(run.azimuth_deg, done[0].azimuth_deg));
  const mean = azimuths.reduce((a, b) => a + b) / done.length;
  const scatter = Math.sqrt(azimuths.reduce((sum, deg) => sum + (deg - mean) ** 2, 0) / (done.length - 1 || 1));
  return { mean, scatter, sigma: done.map((run) => run.azimuth_sigma_deg).sort((a, b) => a - b)[done.length >> 1] };
}

export function mount(store) {
  const [title, marks, chart] = [h("h2"), h("p.aside"), h("div.control-chart")];
  $("control").append(h("header", {}, title, marks), chart);
  store.on("lang", () => {
    write(title, t("Azimuth by run"));
    write(marks, `○ ${t("in progress")} · ▲ ${t("attention")} · ■ ${t("stopped, failed")}`);
  });
  createChart(chart, store, ["runs", "run", "estimates"], (look) => build(store.state, look));
}

function build(state, look) {
  const some = live(state).filter((run) => run.kind === "north-seek" && run.rig_name === (state.rig?.name ?? run.rig_name)).slice(0, Math.floor(look.width / RUN_PX)).reverse();
  const sound = some.filter((run) => run.state === "completed" && !doubtful(run));
  const all = statistics(sound);
  const centre = all?.mean ?? some.at(-1)?.azimuth_deg ?? 0;
  const drawn = some.map((run, x) => {
    const known = run.azimuth_deg != null && (run.state === "completed" || run.azimuth_sigma_deg < WIDE * (all?.sigma ?? 1));
    return { run, x, mark: markOf(run), y: known ? near(run.azimuth_deg, centre) : null, sigma: known ? run.azimuth_sigma_deg : 0 };
  });
  const { scatter = 0 } = all ?? {};
  const ends = drawn.filter((d) => d.y !== null).flatMap(({ y, sigma }) => [y - 2 * sigma, y + 2 * sigma]).concat(centre - 3 * scatter - 1e-4, centre + 3 * scatter + 1e-4);
  const [low, high] = [Math.min(...ends), Math.max(...ends)];
  const room = 0.08 * (high - low);
  const data = Object.entries(MARKS).map(([mark, [colour, symbol, size]]) => {
    const own = drawn.filter((d) => d.mark === mark && (d.y !== null || mark === "stopped"));
    return points(own.map((d) => d.x), own.map((d) => d.y ?? low - room), look[colour], symbol, size, own.map((d) => d.sigma), mark === "live" ? look.paper : null);
  });
  const day = ({ run }) => new Date(run.created).toLocaleDateString(locale(), { day: "numeric", month: "short" });
  const ticks = drawn.length ? [[drawn.length - 1, t(drawn.at(-1).mark === "live" ? "now" : "newest")]] : [];
  const apart = (LABEL_PX * drawn.length) / look.width;
  drawn.toReversed().filter((d) => !d.x || day(d) !== day(drawn[d.x - 1])).forEach((d) => d.x < ticks.at(-1)[0] - apart && ticks.push([d.x, day(d)]));
  const level = (text, y) => label(text, 1, y, { xref: "paper", xanchor: "left", xshift: 4 });
  const mean = centre.toFixed(decimals(2 * (all?.sigma ?? 1)));
  const n = sound.length;
  const annotations = [heading(look, t("azimuth, °, ±2σ"))];
  const shapes = [];
  if (!drawn.length) annotations.splice(0, 1, label(t("No north-seek yet."), 0, 1, { xref: "paper", yref: "paper" }));
  if (all) {
    annotations.push(level(`${t("mean")} ${mean}°`, centre));
    shapes.push(line(0, centre, 1, centre, look.edge, { xref: "paper" }));
  }
  if (n > 2) {
    if (3 * scatter > 0.12 * (high - low)) annotations.push(level("+3σ", centre + 3 * scatter), level("−3σ", centre - 3 * scatter));
    shapes.unshift({ type: "rect", xref: "paper", x0: 0, x1: 1, y0: centre - 3 * scatter, y1: centre + 3 * scatter, fillcolor: look.wash, line: { width: 0 }, layer: "below" });
  }
  return {
    data,
    layout: {
      shapes, annotations, margin: { r: 8.5 * look.size },
      xaxis: axis(look, { visible: drawn.length > 0, range: [-0.6, Math.max(drawn.length, 2) - 0.4], tickvals: ticks.map(([x]) => x), ticktext: ticks.map(([, text]) => text) }),
      yaxis: { ...azimuthAxis(look, low - 2 * room, high + room), visible: drawn.length > 0 },
    },
    text: n ? t("control.text", { n, mean, scatter: scatter.toFixed(4) }) : t("No north-seek yet."),
  };
}
