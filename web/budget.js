// Where the uncertainty comes from: blue from this run, grey from the configuration or a prediction.

import { $, fill, h } from "./dom.js";
import { t } from "./i18n.js";
import { row } from "./tables.js";

const MEASURED = { "north-seek": ["gyro noise", "accelerometer noise"], alignment: ["sway of the base"] }; // the rest is the configuration's

export function mount(store) {
  const panel = $("budget");
  store.on(["run", "prediction"], ({ run, prediction, lang }) => {
    const final = run?.result?.budget;
    const stopped = run?.finished || run?.state === "failed"; // a prediction says nothing of what stopped
    const rows = (final ?? (stopped ? null : run ? run.prediction : prediction)?.budget ?? []).filter((part) => part.u_deg > 0).sort((a, b) => b.u_deg - a.u_deg);
    panel.hidden = !rows.length;
    fill(panel, JSON.stringify([rows, lang, !final]), () => [
      h("h2", {}, t("Budget"), " ", h("small", {}, t(final ? "1σ, share of variance" : "predicted, 1σ"))),
      h("table.budget", {}, ...rows.map(({ source, u_deg, share }) => {
        const bar = h(final && MEASURED[run.kind]?.includes(source) ? "i.measured" : "i", { style: `width:${Math.max(1, (100 * u_deg) / rows[0].u_deg)}%` });
        return row(t(source), bar, u_deg < 1e-4 ? "<0.0001°" : `${u_deg.toFixed(4)}°`, share < 0.001 ? "<0.1 %" : `${(100 * share).toFixed(1)} %`);
      })),
      final && MEASURED[run.kind] && h("p.note", {}, h("span.key.bar.measured", {}, t("from this run")), h("span.key.bar", {}, t("from the rig's configuration"))),
    ]);
  });
}
