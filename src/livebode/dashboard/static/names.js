// @ts-check
// What a person calls the curves of the Bode plot; references have names of their own.
import { tr } from "./language.js";

/** @import { Curves } from "./messages.js" */

/** @type {Partial<Record<Curves, string>>} */
const names = {
  measured: tr("measured"),
  reference: tr("reference"),
  baseline: tr("baseline"),
  model: tr("fitted model"),
  "what if": tr("what if"),
  result: tr("computed curve"),
};

/** @param {Curves} curve */
export const nameOf = (curve) => names[curve] ?? curve;

/**
 * @param {Curves} curve
 * @param {string} name
 */
export function call(curve, name) {
  names[curve] = name;
}

/**
 * A computed curve, by the names of its parts.
 *
 * @param {import("./arithmetic.js").Operation} operation
 */
export const resultOf = ({ kind, a, b }) => `${nameOf(a)} ${kind === "ratio" ? "/" : "−"} ${nameOf(b)}`;
