// How the azimuth settles: after each visit with two sigma, and where it is predicted to go.

import { axis, azimuthAxis, createChart, curve, heading, label, line, points } from "./charts.js";
import { $, h, write } from "./dom.js";
import { near, plusMinus } from "./format.js";
import { t } from "./i18n.js";
import { planned } from "./run.js";

const MOST_POINTS = 900;
const SHOWN_SIGMAS = 6; // half the axis, in present sigmas: the funnel's beginning is cut off

export function mount(store) {
  const title = h("h2");
  const chart = h("div.settle-chart");
  $("settle").append(title, chart);
  store.on("lang", () => write(title, t("How it settles")));
  createChart(chart, store, ["run", "visits", "estimates"], (look) => build(store.state, look));
}

// Variance of the direction after each visit, up to a factor: the normal equations of R, a and b.
function variances(angles, azimuthDeg) {
  const unit = (deg) => [Math.cos((deg * Math.PI) / 180), Math.sin((deg * Math.PI) / 180)];
  const [c, s] = unit(azimuthDeg);
  let [x, y, xx, xy, yy] = [0, 0, 0, 0, 0];
  return angles.map((deg, k) => {
    const [cos, sin] = unit(deg);
    [x, y, xx, xy, yy] = [x + cos, y + sin, xx + cos * cos, xy + cos * sin, yy + sin * sin];
    const [p, q, r] = [xx - (x * x) / (k + 1), xy - (x * y) / (k + 1), yy - (y * y) / (k + 1)];
    return (s * s * r + 2 * s * c * q + c * c * p) / Math.max(p * r - q * q, 1e-9);
  });
}

function build(state, look) {
  const { run, visits } = state;
  if (run?.kind !== "north-seek") return { data: [], layout: {}, text: "" };
  const every = Math.ceil(state.estimates.length / MOST_POINTS);
  const estimates = state.estimates.filter((_, k, all) => (all.length - 1 - k) % every === 0);
  const again = visits.filter((v) => v.repeats != null).length; // they count, but no plan foresaw them
  const last = estimates.at(-1) ?? { azimuth_deg: 0, visits: 3 };
  const middle = last.azimuth_deg;
  const angles = planned(state).map((p) => p.angle_deg);
  const end = angles.length + again || last.visits;
  const final = run?.prediction?.azimuth_sigma_deg ?? last.azimuth_sigma_deg ?? 1;
  const half = SHOWN_SIGMAS * (last.azimuth_sigma_deg || 4 * final);
  const cut = (deg) => Math.max(middle - 2 * half, Math.min(middle + 2 * half, deg));
  const x = estimates.map((e) => e.visits);
  const so = estimates.map((e) => near(e.azimuth_deg, middle));
  const edge = (sign) => estimates.map((e, k) => cut(so[k] + sign * 2 * e.azimuth_sigma_deg));
  const shape = variances(angles, middle);
  const ahead = shape.map((v) => 2 * final * Math.sqrt(v / shape.at(-1))).slice(last.visits - again - 1);
  const funnel = (sign) => curve(ahead.map((_, k) => last.visits + k), ahead.map((u) => cut(middle + sign * u)), look.blue, "1.5px,2.5px");
  const data = [
    curve([...x, ...x.toReversed()], [...edge(1), ...edge(-1).toReversed()], "transparent", "", { fill: "toself", fillcolor: look.band }),
    funnel(1), funnel(-1), curve(x, so.map(cut), look.blue), points(x.slice(-1), so.slice(-1), look.blue, "circle", 7),
  ];
  const back = planned(state).findIndex((p) => p.direction === "back");
  const turn = back + again;
  const top = (word, xanchor) => label(t(word), turn, 1, { yref: "paper", yanchor: "top", xanchor, xshift: xanchor === "right" ? -5 : 5 });
  const u = plusMinus(final);
  return {
    data,
    layout: {
      xaxis: axis(look, { range: [0, end], tickvals: [0, 1, 2, 3, 4].map((k) => Math.round((k * end) / 4)) }),
      yaxis: azimuthAxis(look, middle - half, middle + half),
      shapes: back > 0 ? [line(turn, 0, turn, 1, look.hairline, { yref: "paper" })] : [],
      annotations: [
        heading(look, t("azimuth, °, ±2σ")), ...(back > 0 ? [top("out", "right"), top("back", "left")] : []),
        label(t("visits"), 0.875 * end, 0, { yref: "paper", yanchor: "top", yshift: -0.45 * look.size }),
        label(`${t("predicted")} ${u}`, end, cut(middle + 2 * final), { xanchor: "right", yanchor: "bottom", yshift: 3, font: { color: look.ink2 } }),
      ],
    },
    text: t("settle.text", { n: estimates.length ? last.visits : 0, end, azimuth: middle.toFixed(3), now: plusMinus(last.azimuth_sigma_deg), u }),
  };
}
