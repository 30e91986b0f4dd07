// Plotly weighs megabytes and holds the page up for most of a second when it starts. So it starts when
// nothing else wants the page: once the form stands, and before a run has a needle to move.

let loading = null;

const idle = () => new Promise((resolve) => (window.requestIdleCallback ?? setTimeout)(resolve));

const script = (src) => new Promise((resolve, reject) => {
  const element = document.createElement("script");
  element.src = src;
  element.onload = () => resolve(window.Plotly);
  element.onerror = () => reject(new Error(`The charts need ${src}, which did not load.`));
  document.head.append(element);
});

/** Return Plotly, loaded at the first asking; one that did not load is asked for again. */
export function loadPlotly() {
  loading ??= idle().then(() => script(document.querySelector("meta[name=plotly]").content));
  loading.catch(() => { loading = null; });
  return loading;
}
