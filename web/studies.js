// The papers behind it: what each claims, what we find, and the verdict. Nothing is asked for before the fold opens,
// and a paper is worked through only when the reader wants it.

import { get } from "./api.js";
import { $, fill, h, s, write } from "./dom.js";
import { t } from "./i18n.js";

const PATIENCE_MS = 180000; // the first time each is computed, one after the other
const VERDICTS = { // shape and colour; the word is the verdict itself
  reproduced: ["M2 8.6l4 4.2L14 3.6", "blue"], "not reproduced": ["M3 3l10 10M13 3L3 13", "red"],
  misprint: ["M11.2 2.2l2.6 2.6L5.6 13 2 14l1-3.6zM9 4.4l2.6 2.6", "orange"], "beyond the paper": ["M8 1.5v13M1.5 8h13", ""],
};
const SIGNS = { deg: "°", arcmin: "′", arcsec: "″", "deg/h": " °/h" };
// A drawing has the light colours written in it; here the page's light decides.
const THEME = { "#15171a": "ink", "#4b5056": "ink2", "#676c72": "ink3", "#8d9297": "edge", "#d8d8d4": "hairline", "#0b5cd5": "blue", "#d67200": "orange", "#ffffff": "paper" };

const address = (name, rest = "") => `/api/v1/studies/${name}${rest}`;

/** Fill the fold. */
export function mount(store) {
  const panel = $("studies-body");
  const said = h("p.error", { role: "alert" });
  const list = h("ul.studies");
  const known = new Map(); // what has come, by name
  panel.append(said, list);

  async function load() {
    const { studies } = await get("/studies");
    fill(list, studies.map(({ name }) => name).join(), () => studies.map((entry) => item(entry)));
  }

  function item({ name, verdicts }) {
    const [title, counts, body] = [h("b"), h("span.counts"), h("div.study", { "aria-live": "polite" })];
    const fold = h("details", { "data-study": name }, h("summary", {}, title, counts), body);
    let wanted = false;
    const show = () => {
      write(title, t(`study.${name}`));
      const study = known.get(name);
      fill(counts, JSON.stringify(study?.claims.length ?? verdicts) + store.state.lang, () => tally(study ? counted(study) : verdicts));
      fill(body, `${Boolean(study)} ${store.state.lang}`, () => (study ? view(study) : [h("p.note", {}, t("study.wait"))]));
    };
    fold.addEventListener("toggle", async () => {
      if (!fold.open || wanted) return;
      wanted = true;
      try {
        known.set(name, await get(`/studies/${name}`, PATIENCE_MS));
        show();
        await drawFigures(body, name);
      } catch (problem) {
        wanted = false;
        body.replaceChildren(h("p.error", { role: "alert" }, problem.message));
        delete body.dataset.key;
      }
    });
    store.on("lang", () => { show(); if (known.has(name)) drawFigures(body, name).catch(reportError); });
    return h("li", {}, fold);
  }

  load().catch((problem) => write(said, problem.message));
}

const counted = ({ claims }) => Object.fromEntries(Object.keys(VERDICTS).map((verdict) => [verdict, claims.filter((claim) => claim.verdict === verdict).length]));

const tally = (verdicts) => Object.entries(verdicts ?? {}).filter(([, n]) => n).map(([verdict, n]) => h("span", {}, sign(verdict), ` ${n} ${t(verdict)}`));

const sign = (verdict) => s("svg", { class: `icon ${VERDICTS[verdict][1]}`, viewBox: "0 0 16 16", "aria-hidden": "true" },
  s("path", { d: VERDICTS[verdict][0], fill: "none", stroke: "currentColor", "stroke-width": verdict === "misprint" ? 1.5 : 2.2 }));

function view({ name, paper, summary, conditions, claims, figures }) {
  return [
    h("p.note", { lang: "en" }, paper),
    h("p.lead", { lang: "en" }, summary),
    h("p", {}, h("a", { href: address(name, "/page.html"), target: "_blank" }, t("The whole study on one page, to read or print"))),
    h("div.scroll", { tabindex: 0, role: "region", "aria-label": t(`study.${name}`) }, h("table.rows.claims", {},
      h("thead", {}, h("tr", {}, ...["where", "the claim, and what we found", "printed", "ours", "verdict"].map((word) => h("th", { scope: "col" }, t(word))))),
      h("tbody", {}, ...claims.map(row)))),
    h("p.note", { lang: "en" }, conditions),
    h("div.drawings", {}, ...figures.map((figure) => h("figure", { "data-figure": figure.name }, h("h3", { lang: "en" }, figure.title), h("div.drawing", { lang: "en", tabindex: 0, role: "region", "aria-label": figure.title }), h("figcaption.note", { lang: "en" }, figure.description)))),
  ];
}

function row({ where, says, conditions, printed, ours, verdict, reason }) {
  return h("tr", { lang: "en" }, h("th", { scope: "row" }, where),
    h("td", {}, says, conditions ? h("span.note", {}, ` ${conditions}`) : null, h("p.note", {}, reason)),
    h("td.figures", { "data-name": t("printed") }, written(printed)), h("td.figures", { "data-name": t("ours") }, written(ours)),
    h("td.verdict", { lang: document.documentElement.lang }, sign(verdict), " ", t(verdict)));
}

// 8.55°, 0.067 °/h, 1.97 × 10⁻³ °/h; a dash where there is none.
function written(quantity) {
  if (!quantity) return "–";
  const { text, unit } = quantity;
  const number = unit ? text.slice(0, -unit.length).trim() : text;
  const raised = (power) => [...power].map((one) => (one === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[one])).join("");
  return number.replace(/e\+?(-?\d+)/, (_, power) => ` × 10${raised(power)}`).replace(/^(<? ?)-/, "$1−") + (SIGNS[unit] ?? (unit && ` ${unit}`));
}

async function drawFigures(body, name) {
  for (const figure of body.querySelectorAll("figure")) {
    const answer = await fetch(address(name, `/figures/${figure.dataset.figure}.svg`));
    if (!answer.ok) throw new Error(t("A figure did not come."));
    const themed = (await answer.text()).replace(/#[0-9a-f]{6}/g, (colour) => (THEME[colour] ? `var(--${THEME[colour]}, ${colour})` : colour));
    figure.querySelector(".drawing").replaceChildren(document.importNode(new DOMParser().parseFromString(themed, "image/svg+xml").documentElement, true));
  }
}
