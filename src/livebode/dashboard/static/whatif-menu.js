// @ts-check
// The menu "What if": a gain, a low-pass filter, a notch and a delay on the loop that is shown, and its margins then.
import { chosen, remember } from "./address.js";
import { tr } from "./language.js";
import { byId as $, element } from "./make.js";
import { popover } from "./popover.js";
import { NONE } from "./whatif.js";
import { triedWords } from "./whatif-marks.js";

/** @import { Bode } from "./bode.js" */
/** @import { Filter } from "./whatif.js" */

/** @type {[part: keyof Filter, words: string, low: number, high: number][]} */
const FIELDS = [
  ["gainDb", tr("gain in dB"), -200, 200],
  ["lowpassHz", tr("first-order low-pass in Hz, 0 without"), 0, 1e6],
  ["notchHz", tr("notch of 20 dB in Hz, 0 without"), 0, 1e6],
  ["notchDamping", tr("damping of the notch"), 0.001, 10],
  ["delayMs", tr("delay in ms"), 0, 10_000],
];
const TEXT_MS = 200;

/** @param {Filter} filter */
const textOf = (filter) => FIELDS.map(([part]) => String(filter[part])).join("_");

/** @param {string} text @returns {Filter} */
function filterOf(text) {
  const values = text.split("_").map(Number);
  const fits =
    values.length === FIELDS.length && FIELDS.every(([, , low, top], i) => values[i] >= low && values[i] <= top);
  return fits ? /** @type {Filter} */ (Object.fromEntries(FIELDS.map(([part], i) => [part, values[i]]))) : { ...NONE };
}

/** @param {Bode} bode */
export function whatIfMenu(bode) {
  const [button, panel] = [$("what-if"), $("what-if-panel")];
  let filter = filterOf(chosen("what-if", ""));
  const result = element("p", { class: "tried" });
  const tell = () => {
    if (panel.isConnected && !panel.hidden) result.textContent = triedWords(bode, filter);
  };
  const apply = () => {
    const text = textOf(filter),
      on = text !== textOf(NONE);
    remember("what-if", on ? text : "", "");
    bode.filter = on ? filter : null;
    button.classList.toggle("changed", on);
    if (bode.charts.length) bode.draw();
    tell();
  };
  const fill = () => {
    const fields = FIELDS.map(([part, name, min, max]) => {
      const input = element("input", { type: "number", step: "any", min, max, value: filter[part], "data-part": part });
      input.addEventListener("change", () => {
        const value = Number.isFinite(input.valueAsNumber) ? input.valueAsNumber : NONE[part];
        filter = { ...filter, [part]: Math.min(max, Math.max(min, value)) };
        input.value = String(filter[part]);
        apply();
      });
      return element("label", {}, element("span", {}, name), input);
    });
    const off = () => {
      filter = { ...NONE };
      fill();
      apply();
    };
    panel.replaceChildren(
      element("p", {}, tr("A calculation in this page: it proposes nothing to the machine, and it is not recorded.")),
      ...fields,
      result,
      element("button", { type: "button", onclick: off }, tr("without all of these")),
    );
    result.textContent = triedWords(bode, filter);
  };
  setInterval(tell, TEXT_MS);
  apply();
  return popover(button, panel, fill);
}
