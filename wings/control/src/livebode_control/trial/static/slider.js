// @ts-check
// A slider with a number field beside it: the slider for the usual range, the field for any value.
import { element } from "./make.js";
import { plain } from "./words.js";

const STEPS = 400; // an arrow key is a step; Page Up and Page Down a tenth of the range

/**
 * @typedef {object} Range
 * @property {string} name in the data-part of both
 * @property {string} words
 * @property {string} unit
 * @property {(value: number) => string} [beside] shown in place of the unit
 * @property {number} low of the slider
 * @property {number} high of the slider
 * @property {boolean} [linear] by default logarithmic
 * @property {[number, number]} limits of the field
 * @property {number} value
 * @property {(value: number) => void} onChange
 */

/**
 * A row of four: words, slider, field, unit. A negative value has its size on the slider.
 *
 * @param {Range} range
 */
export function slider({ name, words, unit, beside, low, high, linear, limits, value, onChange }) {
  const sign = value < 0 ? -1 : 1,
    whole = unit ? `${words}, ${unit}` : words;
  const share = (/** @type {number} */ v) =>
      linear ? (v - low) / (high - low) : Math.log(Math.max(Math.abs(v), 1e-300) / low) / Math.log(high / low),
    valueAt = (/** @type {number} */ part) =>
      Number((linear ? low + part * (high - low) : sign * low * (high / low) ** part).toPrecision(4));
  const shared = { "aria-label": whole, "data-part": name };
  const bar = element("input", { type: "range", min: 0, max: STEPS, step: 1, ...shared }),
    field = element("input", { type: "number", step: "any", min: limits[0], max: limits[1], ...shared }),
    behind = element("span", { class: "unit", "aria-hidden": "true" });
  const show = (/** @type {number} */ v, /** @type {HTMLInputElement | null} */ by) => {
    if (by !== bar) bar.value = String(STEPS * share(v));
    if (by !== field) field.value = String(v);
    bar.setAttribute("aria-valuetext", `${plain(v)} ${unit}`.trim());
    behind.textContent = beside ? beside(v) : unit;
  };
  bar.addEventListener("input", () => {
    const next = valueAt(Number(bar.value) / STEPS);
    show(next, bar);
    onChange(next);
  });
  field.addEventListener("change", () => {
    const next = field.valueAsNumber;
    const fits = Number.isFinite(next) && (linear || (next && Math.sign(next) === sign));
    const used = fits ? Math.min(limits[1], Math.max(limits[0], next)) : value;
    show(used, null);
    onChange(used);
  });
  show(value, null);
  return element("div", { class: "slider" }, element("span", { "aria-hidden": "true" }, words), bar, field, behind);
}
