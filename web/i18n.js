// Every word of the page. A short text is its own key in English; sentences and translations stand in words.json.

const STORED = "northfinder.lang";
const tables = await (await fetch("/static/words.json")).json();
let words = tables.en;

/** Return the words in the page's language, `{name}` filled from `values`. */
export function t(key, values = {}) {
  return (words[key] ?? tables.en[key] ?? key).replace(/\{(\w+)\}/g, (whole, name) => values[name] ?? whole);
}

/** Speak `lang`, by default what this browser chose before or prefers; returns the language. */
export function speak(lang = localStorage.getItem(STORED) ?? (navigator.language.startsWith("zh") ? "zh" : "en")) {
  words = tables[lang];
  document.documentElement.lang = lang === "zh" ? "zh-Hans" : "en";
  for (const element of document.querySelectorAll("[data-t]")) {
    element.dataset.t ||= element.textContent;
    element.textContent = t(element.dataset.t);
  }
  for (const [name, key] of [["aria-label", "tLabel"], ["title", "tTitle"]]) {
    for (const element of document.querySelectorAll(`[${name}]`)) if (element.dataset[key]) element.setAttribute(name, t(element.dataset[key]));
  }
  return lang;
}

/** Speak `lang` now and at the next visit. */
export function choose(lang) {
  localStorage.setItem(STORED, lang);
  return speak(lang);
}
