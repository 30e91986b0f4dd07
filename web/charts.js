// The one look of every chart: two thin axes, no grid, units above the axis, whiskers of two sigma.

import { digits, wrap } from "./format.js";
import { loadPlotly } from "./drawing.js";

const REDRAW_MS = 500;
const COLOURS = ["paper", "ink", "ink2", "ink3", "edge", "hairline", "blue", "band", "wash", "orange", "red"];
const waiting = new Set();
const clock = { timer: null, last: -REDRAW_MS };

function request(chart) {
  waiting.add(chart);
  clock.timer ??= setTimeout(flush, Math.max(0, clock.last + REDRAW_MS - performance.now()));
}

// One chart a frame: the numbers and the dial do not wait for all of them.
async function flush() {
  clock.last = performance.now();
  const due = [...waiting];
  waiting.clear();
  try {
    const plotly = await loadPlotly();
    for (const chart of due) {
      await new Promise(requestAnimationFrame);
      await chart(plotly).catch(reportError);
    }
  } finally {
    clock.timer = null;
    waiting.forEach(request);
  }
}

/** Draw `build(look)`, that is {data, layout, text}, into `figure` whenever `keys` of the store, its size or the colours change. */
export function createChart(figure, store, keys, build) {
  const plot = document.createElement("div");
  plot.setAttribute("role", "img");
  figure.classList.add("chart");
  figure.append(plot);
  const draw = async (plotly) => {
    const { clientWidth: width, clientHeight: height } = figure;
    if (!width) return;
    const style = getComputedStyle(figure);
    const look = { width, size: parseFloat(style.fontSize) };
    for (const name of COLOURS) look[name] = style.getPropertyValue(`--${name}`);
    const { length } = store.state.visits;
    const { data, layout, text } = build(look);
    const margin = { l: 4 * look.size, r: look.size, t: 2 * look.size, b: 2 * look.size, ...layout.margin };
    await plotly.react(plot, data, {
      paper_bgcolor: "transparent", plot_bgcolor: "transparent", showlegend: false, font: { family: style.fontFamily, size: look.size, color: look.ink3 }, ...layout, width, height, margin,
    }, { staticPlot: true });
    plot.setAttribute("aria-label", text);
    plot.dataset.visits = length;
  };
  const redraw = () => request(draw);
  store.on(keys, redraw);
  new ResizeObserver(redraw).observe(figure);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw);
}

export const axis = ({ edge }, more) => ({ showgrid: false, zeroline: false, linecolor: edge, tickcolor: edge, ticks: "outside", ticklen: 4, tickangle: 0, ticklabeloverflow: "allow", ...more });

export const label = (text, x, y, more) => ({ text, x, y, showarrow: false, ...more });

/** The quantity and its unit, above the axis. */
export const heading = ({ ink2, size }, text, yref = "y") =>
  label(text, 0, 1, { xref: "paper", yref: `${yref} domain`, xanchor: "left", yanchor: "bottom", xshift: -size / 2, yshift: size / 3, font: { color: ink2 } });

export const line = (x0, y0, x1, y1, color, more, dash) => ({ type: "line", x0, y0, x1, y1, layer: "below", line: { color, width: 1, dash }, ...more });

export const curve = (x, y, color, dash, more) => ({ mode: "lines", x, y, line: { color, width: 1.4, dash }, ...more });

/** Marks, with whiskers of two `sigma` where it is given; a ring is a circle filled with `hollow`. */
export const points = (x, y, color, symbol, size, sigma, hollow, more) => ({
  mode: "markers", x, y, cliponaxis: false, marker: { color: hollow ?? color, symbol, size, line: { width: hollow ? 1.5 : 0, color } },
  error_y: { visible: Boolean(sigma), array: sigma?.map((s) => 2 * s), width: 0, thickness: 1, color }, ...more,
});

/** A logarithmic axis: decades alone where there are several of them, else with 2 and 5 between; `range` in decades. */
export function logAxis(look, [from, to], more) {
  const steps = to - from > 2.2 ? [1] : [1, 2, 5];
  const tickvals = [];
  for (let power = Math.floor(from); power <= to; power++) {
    for (const step of steps) if (Math.log10(step) + power >= from && Math.log10(step) + power <= to) tickvals.push(+`${step}e${power}`);
  }
  return axis(look, { type: "log", range: [from, to], tickvals, ticktext: tickvals.map((value) => digits(value, 1).replace(/^1·/, "")), ...more });
}

/** An axis whose ticks go round with the circle: it may run from 359.8 past 360 to 0.2. */
export function azimuthAxis(look, from, to) {
  const rough = (to - from) / 4;
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((m) => m * power >= rough);
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  const first = Math.ceil(from / step);
  const tickvals = Array.from({ length: Math.floor(to / step) - first + 1 }, (_, k) => (first + k) * step);
  return axis(look, { range: [from, to], tickvals, ticktext: tickvals.map((deg) => wrap(+deg.toFixed(digits)).toFixed(digits)) });
}
