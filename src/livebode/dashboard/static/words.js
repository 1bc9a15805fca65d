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

const BOUND_DIGITS = 2,
  PLACES_MAX = 9;
/**
 * A value with its bound: the bound has two digits, and the value as many as the bound leaves.
 *
 * @param {number} value
 * @param {number} bound of any size; NaN or 0 if it is not known
 */
export function pair(value, bound) {
  if (!(bound > 0 && Number.isFinite(bound) && Number.isFinite(value))) return plain(value);
  const top = Math.floor(Math.log10(Math.max(Math.abs(value), bound)));
  const power = top < -4 || top > 6 ? top : 0; // of ten that both have in common
  const place = Math.floor(Math.log10(bound)) - power + 1 - BOUND_DIGITS;
  /** @param {number} v */
  const rounded = (v) => {
    const scaled = v / 10 ** power;
    return place > 0
      ? String(Math.round(scaled / 10 ** place) * 10 ** place)
      : fixed(scaled, Math.min(-place, PLACES_MAX));
  };
  const text = `${rounded(value)} ± ${rounded(bound)}`.replace("-", "−");
  return power ? `(${text})e${power < 0 ? "−" : ""}${Math.abs(power)}` : text;
}

/** @param {string} unit as it is shown after a number */
export const afterNumber = (unit) => (unit === "deg" || unit === "°" ? "°" : unit && ` ${unit}`);

/**
 * Decimal places with which a bound has two digits, and no fewer than `least`.
 *
 * @param {number} bound
 * @param {number} least
 */
export const places = (bound, least) =>
  bound > 0 && Number.isFinite(bound)
    ? Math.min(Math.max(BOUND_DIGITS - 1 - Math.floor(Math.log10(bound)), least), PLACES_MAX)
    : least;

/** @param {number} value what rounds to zero has no minus sign */
export const signed = (value, digits = 1) =>
  Number.isFinite(value) ? `${Number(value.toFixed(digits)) < 0 ? "−" : "+"}${fixed(Math.abs(value), digits)}` : "–";

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
