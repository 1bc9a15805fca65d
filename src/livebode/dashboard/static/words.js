// @ts-check
// Numbers and names for people.

/** @param {number | null | undefined} value */
export function plain(value, digits = 4) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  const text =
    Math.abs(value) >= 1e6 || (value !== 0 && Math.abs(value) < 1e-3)
      ? Number(value.toPrecision(digits)).toExponential().replace("e+", "e")
      : Number(value.toPrecision(digits)).toString();
  return text.replace("-", "−");
}

/** @param {number} value */
export const signed = (value, digits = 1) =>
  Number.isFinite(value) ? `${value < 0 ? "−" : "+"}${Math.abs(value).toFixed(digits)}` : "–";

/** @param {number} f */
export function hertz(f) {
  if (f >= 1e5) return `${Number((f / 1000).toPrecision(4))}k`;
  return Number(f.toPrecision(5)).toString();
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
