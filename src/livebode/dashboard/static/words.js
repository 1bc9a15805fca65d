// @ts-check
// Numbers and names for people.
import { numeral, tr } from "./language.js";

/**
 * @param {number} value
 * @param {number} digits
 */
export const fixed = (value, digits) => numeral(value.toFixed(digits));

/**
 * The number of a mark on an axis.
 *
 * @param {number} value
 */
export const mark = (value) => numeral(String(Number(value.toFixed(6)))).replace("-", "−");

/** @param {number | null | undefined} value */
export function plain(value, digits = 4) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  const text =
    Math.abs(value) >= 1e6 || (value !== 0 && Math.abs(value) < 1e-3)
      ? Number(value.toPrecision(digits)).toExponential().replace("e+", "e")
      : Number(value.toPrecision(digits)).toString();
  return numeral(text).replace("-", "−");
}

/** @param {number} value */
export const signed = (value, digits = 1) =>
  Number.isFinite(value) ? `${value < 0 ? "−" : "+"}${fixed(Math.abs(value), digits)}` : "–";

/** @param {number} f */
export function hertz(f) {
  if (f >= 1e5) return `${numeral(String(Number((f / 1000).toPrecision(4))))}k`;
  return numeral(String(Number(f.toPrecision(5))));
}

/**
 * The label of an axis of the scheduling signal.
 *
 * @param {import("./messages.js").Named} schedule
 */
export function label({ name, unit }) {
  const known = name || tr("schedule");
  return unit ? tr("{name} in {unit}", { name: known, unit }) : known;
}

/**
 * "x in m" → name and unit.
 *
 * @param {string} label
 * @returns {import("./messages.js").Named}
 */
export function named(label) {
  const cut = label.lastIndexOf(" in ");
  return cut < 0 ? { name: label, unit: "" } : { name: label.slice(0, cut), unit: label.slice(cut + 4) };
}
