// Where the service asks for a token: ask the reader once, then go on.

import { post } from "./api.js";
import { $, write } from "./dom.js";
import { t } from "./i18n.js";

/** Ask for the token until the service takes it. */
export function askForToken() {
  const dialog = $("session");
  dialog.showModal();
  dialog.addEventListener("cancel", (event) => event.preventDefault());
  return new Promise((admitted) => {
    dialog.querySelector("form").onsubmit = async (event) => {
      event.preventDefault();
      try {
        await post("/session", { token: $("token").value });
        $("token").value = "";
        dialog.close();
        admitted();
      } catch (problem) {
        write($("token-error"), problem.status === 401 ? t("This is not the token.") : problem.message);
      }
    };
  });
}
