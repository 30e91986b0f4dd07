// The rates over one revolution, the cosine through them, and what it leaves over.

import { axis, createChart, curve, heading, label, line, points } from "./charts.js";
import { $, h, write } from "./dom.js";
import { decimals, fixed, wrap } from "./format.js";
import { t } from "./i18n.js";
import { reduce } from "./reduce.js";
import { measured, newest, planned } from "./run.js";

const STEP_DEG = 1.5;
const ascending = (some) => [...new Set(some)].sort((a, b) => a - b);

export function mount(store) {
  const parts = ["h2", "span.key", "span.key.ring", "span.key.stroke", "p.aside"].map((what) => h(what));
  const chart = h("div.fit-chart");
  const note = h("p.note");
  $("fit").append(h("header", {}, ...parts), chart, note);
  store.on(["run", "visits", "estimates"], (state) => {
    const fit = !state.run?.result && newest(state)?.gyro_fit;
    const aside = fit ? `R ${fixed(fit.R_deg_h, 2)} · a ${fixed(fit.a_deg_h, 2)} · b ${fixed(fit.b_deg_h, 2)} °/h` : "";
    [t("Fit"), t("out"), t("back"), "R + a cos T + b sin T", aside].forEach((text, k) => write(parts[k], text));
    const { rows, shifted } = reduce(state);
    write(note, [shifted, rows.some((row) => row.leftOut) && "fit.left_out"].filter(Boolean).map((key) => t(key)).join(" "));
  });
  createChart(chart, store, ["run", "visits", "estimates", "prediction"], (look) => build(store.state, look));
}

function build(state, look) {
  if (state.run?.kind !== "north-seek") return { data: [], layout: {}, text: "" };
  const { rows, value, north } = reduce(state);
  const done = ascending(rows.map((row) => wrap(row.angle_deg)));
  const angles = ascending([...planned(state).map((p) => wrap(p.angle_deg)), ...done]);
  const rest = angles.filter((deg) => !done.includes(deg));
  const data = value ? courses(value, angles, done, look) : [];
  data.push(points(rest, rest.map((deg) => value?.(deg) ?? 0), look.ink3, "circle", 4.5, null, look.paper));
  const aside = rows.some((row) => row.direction === "back") ? 36 / Math.max(angles.length, 12) : 0;
  for (const back of [false, true]) {
    const some = rows.filter((row) => !row.leftOut && (row.direction === "back") === back);
    const x = some.map((row) => wrap(row.angle_deg));
    data.push(points(x, some.map((row) => row.rate), look.blue, "circle", back ? 9 : 6.5, null, back ? "transparent" : null));
    if (value) data.push(points(x.map((deg) => deg + (back ? aside : -aside)), some.map((row) => row.residual), look.blue, "circle", 5.5, some.map((row) => row.gyro_sigma_deg_h), back ? look.paper : null, { yaxis: "y2" }));
  }
  const away = rows.filter((row) => row.leftOut);
  data.push(points(away.map((row) => wrap(row.angle_deg)), away.map((row) => row.rate), look.orange, "x", 8));
  const most = 1.15 * Math.max(0.01, ...rows.map((row) => (row.leftOut ? 0 : Math.abs(row.residual ?? 0) + 2 * row.gyro_sigma_deg_h)));
  return {
    data,
    layout: {
      ...notes(state, look, { rest, value, north }),
      xaxis: axis(look, { range: [-4, 364], tick0: 0, dtick: look.width > 480 ? 60 : 90, minor: { ticks: "outside", ticklen: 2, tickcolor: look.edge, dtick: 15 }, anchor: "y2", ticksuffix: "°" }),
      yaxis: axis(look, { domain: [0.42, 1], nticks: 6, ...(!rows.length && !value && { range: [-1, 1], ticks: "", showticklabels: false }) }),
      yaxis2: axis(look, { domain: [0, 0.29], range: [-most, most], nticks: 4, showticklabels: Boolean(value), ticks: value ? "outside" : "" }),
    },
    text: t("fit.text", { n: rows.length }),
  };
}

// The curve is solid where the planned angles on both sides of it are measured, dashed elsewhere.
function courses(value, angles, done, look) {
  const x = Array.from({ length: 360 / STEP_DEG + 1 }, (_, k) => k * STEP_DEG);
  const solid = x.map((deg) => done.includes(angles.findLast((p) => p <= deg) ?? angles.at(-1)) && done.includes(angles.find((p) => p >= deg) ?? angles[0]));
  const some = (keep) => x.map((deg, k) => (keep(k) ? value(deg) : null));
  return [curve(x, some((k) => !solid[k] || solid[k - 1] === false || solid[k + 1] === false), look.ink3, "3px,3px"), curve(x, some((k) => solid[k]), look.ink)];
}

function notes(state, look, { rest, value, north }) {
  const { run, visits } = state;
  const annotations = [heading(look, t("rate, °/h")), heading(look, t("residual, °/h, ±2σ"), "y2")];
  const shapes = [line(0, 0, 1, 0, look.hairline, { xref: "paper" }), line(0, 0, 1, 0, look.edge, { xref: "paper", yref: "y2" })];
  const upright = (deg, color, more, dash) => shapes.push(line(deg, 0, deg, 1, color, more, dash));
  const beside = (deg) => ({ xanchor: deg > 240 ? "right" : "left", xshift: deg > 240 ? -3 : 3, yanchor: "bottom" });
  const roomy = look.width > 380;
  if (look.width > 480) annotations.push(label(t("table angle"), 210, 0, { yref: "paper", yanchor: "top", yshift: -0.45 * look.size }));
  if (value) {
    upright(north, look.blue, { yref: "y domain" }, "2px,2px");
    const deg = north.toFixed(decimals(2 * newest(state).azimuth_sigma_deg));
    if (roomy) annotations.push(label(t("gyro faces north at {deg}°", { deg }), north, 0, { yref: "y domain", font: { color: look.ink2 }, ...beside(north) }));
  }
  const far = rest[Math.floor(0.6 * rest.length)];
  if (roomy && rest.length > 2) {
    const right = far <= 270;
    const below = !value || (value(far + 1) > value(far)) === right; // clear of the curve
    const text = t(value ? "still to measure" : "{n} angles to measure", { n: rest.length });
    annotations.push(label(text, far, value?.(far) ?? 0, { xanchor: right ? "left" : "right", yanchor: below ? "top" : "bottom", yshift: below ? -look.size : look.size }));
  }
  const k = measured(visits).length;
  const missed = run?.state === "failed" && planned(state)[k]?.angle_deg;
  if (missed || missed === 0) {
    upright(missed, look.red, { yref: "paper", layer: "above" });
    const inside = missed < 75 && { yanchor: "top" }; // clear of the heading
    annotations.push(label(`■ ${t("stopped at visit {k}, {deg}°", { k: k + 1, deg: Number(missed.toFixed(2)) })}`, missed, 1, { yref: "paper", font: { color: look.red }, ...beside(missed), ...inside }));
  }
  return { annotations, shapes };
}
