// @ts-check
// Buttons of the Bode plot for what the mouse and the keys do: zoom, fixed cursors, peaks.
import { tr } from "./language.js";
import { element } from "./make.js";

/** @import { Bode } from "./bode.js" */

/**
 * @param {HTMLElement} host
 * @param {Bode} bode
 */
export function tools(host, bode) {
  /** @type {[sign: string, words: string, act: () => void][]} */
  const all = [
    ["−", tr("see more of the frequency axis (−)"), () => bode.magnify(false)],
    ["+", tr("see less of the frequency axis (+)"), () => bode.magnify(true)],
    ["⤢", tr("show everything (0)"), () => bode.reset()],
    ["A", tr("fix cursor A at the line under the cursor (X)"), () => bode.place(false)],
    ["B", tr("fix cursor B at the line under the cursor (Y)"), () => bode.place(true)],
    ["×", tr("remove the fixed cursors and the peak (C)"), () => bode.unplace()],
    ["◂∧", tr("previous peak or antiresonance (B)"), () => bode.seek(false)],
    ["∧▸", tr("next peak or antiresonance (N)"), () => bode.seek(true)],
  ];
  host.replaceChildren(
    ...all.map(([sign, words, onclick]) =>
      element("button", { type: "button", "aria-label": words, title: words, onclick }, sign),
    ),
  );
}
