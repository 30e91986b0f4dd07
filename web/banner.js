// What hinders everything: said in words across the page, with what to do.

import { $, fill, h, icon } from "./dom.js";
import { sentence } from "./format.js";
import { t } from "./i18n.js";

export function mount(store) {
  store.on(["connection", "rig", "stopFailed", "trouble"], (state) => {
    const said = troubles(state);
    fill($("banner"), JSON.stringify([said, state.lang]), () => said.map(([name, detail]) => h("p.red", {},
      icon("stopped"),
      h("span", {}, h("b", {}, t(`trouble.${name}`)), ` ${t(`trouble.${name}.do`)} `, detail && h("span.quiet", { lang: "en" }, sentence(detail))))));
  });
}

function troubles({ connection, rig, stopFailed, trouble }) {
  const lost = connection === "lost";
  const offline = rig?.devices.length ? "offline" : "unreached"; // without devices the service itself has lost the rig
  return [
    stopFailed && ["stop", stopFailed],
    lost && ["lost", null],
    !lost && rig?.state === "offline" && [offline, rig.detail],
    !lost && rig?.database?.ok === false && ["database", rig.database.detail],
    !lost && trouble && ["refused", trouble],
  ].filter(Boolean);
}
