// @ts-check
// The frozen reference: a response that remains in the plot.
/** @import { Page } from "./messages.js" */

export const REFERENCE_GONE =
  "A new run with other lines or another quantity has started: the frozen reference was released.";

/**
 * @param {Page} page
 * @param {{bode: import("./bode.js").Bode, link: import("./link.js").Link}} parts
 * @param {HTMLElement} button
 * @param {() => void} legend
 */
export function freezing(page, { bode, link }, button, legend) {
  function freeze() {
    if (page.frozen) {
      letGo();
      return;
    }
    const timeS = bode.curves.measured?.frame.timeS[0];
    if (timeS === undefined) return;
    link.wish({ kind: "freeze", time_s: timeS }, "freeze");
    frozen(true);
  }

  function letGo() {
    link.forget("freeze");
    link.wish({ kind: "unfreeze" });
    bode.drop("reference");
    page.dirty.add("bode");
    frozen(false);
  }

  /** @param {boolean} is */
  function frozen(is) {
    page.frozen = is;
    button.textContent = is ? "Unfreeze" : "Freeze";
    button.classList.toggle("primary", is);
    legend();
  }

  return { freeze, letGo };
}
