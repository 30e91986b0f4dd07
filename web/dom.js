// The few words of DOM that the page is written in.

export const $ = (id) => document.getElementById(id);
export const all = (selector) => document.querySelectorAll(selector);

const builder = (namespace) => (what, attributes = {}, ...children) => {
  const [tag, ...classes] = what.split(".");
  const element = document.createElementNS(namespace, tag);
  if (classes.length) element.setAttribute("class", classes.join(" "));
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value !== null && value !== false) element.setAttribute(name, value === true ? "" : value);
  }
  element.append(...children.filter((child) => child != null));
  return element;
};

/** Build an element: `h("p.quiet", {title: "..."}, "text", child)`; `on...` are listeners, null children are left out. */
export const h = builder("http://www.w3.org/1999/xhtml");

/** Build an SVG element in the same way. */
export const s = builder("http://www.w3.org/2000/svg");

/** Draw one of the page's shapes (index.html's sprite). */
export const icon = (name, colour = "") => s("svg", { class: `icon ${colour}`, "aria-hidden": "true" }, s("use", { href: `#i-${name}` }));

/** Give the shape within `element` another meaning. */
export const setIcon = (element, name) => element.querySelector("use").setAttribute("href", `#i-${name}`);

/** Write text where it changed: what has not changed is not laid out again. */
export function write(element, text) {
  if (element.textContent !== String(text)) element.textContent = text;
}

/** Set what `build` returns as the children, but only when `key` changed: focus and selection stay. */
export function fill(element, key, build) {
  if (element.dataset.key === String(key)) return;
  element.dataset.key = key;
  element.replaceChildren(...build().filter((child) => child != null));
}
