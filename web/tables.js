// The parts that every table of the page is made of.

import { h } from "./dom.js";

/** A row of a table: its heading and its cells. */
export const row = (name, ...cells) => h("tr", {}, h("th", { scope: "row" }, name), ...cells.map((cell) => h("td", {}, cell)));

/** The heading of a table's columns; the first has none. */
export const columns = (...names) => h("tr", {}, h("td"), ...names.map((name) => h("th", { scope: "col" }, ...[name].flat())));

/** A section's name and, at the other end of the line, what else there is to say. */
export const titled = (name, aside) => h("header", {}, h("h2", {}, name), h("p.aside", {}, aside));
