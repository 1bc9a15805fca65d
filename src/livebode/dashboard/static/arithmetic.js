// @ts-check
// A curve computed from two others, line by line. Their errors are taken as independent: no correlation is known.
import { complex, NAMES } from "./curves.js";
import { unwrapped, wrapped } from "./view.js";

/** @import { Curve, Numbers } from "./curves.js" */
/** @import { Curves } from "./messages.js" */
/** @typedef {{kind: "ratio" | "difference", a: Curves, b: Curves}} Operation A/B or A − B */

/**
 * What an address has; null where it has nothing that can be computed.
 *
 * @param {string} text
 * @returns {Operation | null}
 */
export function operationOf(text) {
  const [kind, nameA, nameB] = text.split("~");
  const [a, b] = [nameA, nameB].map((name) => NAMES.find((known) => known === name));
  return (kind === "ratio" || kind === "difference") && a && b ? { kind, a, b } : null;
}

/**
 * The values of a curve at the lines.
 *
 * @param {Curve} curve
 * @param {number[]} at index in the grid of each line
 * @returns {Curve}
 */
function atLines(curve, at) {
  if (curve.index.length === at.length) return curve;
  /** @param {Numbers} values */
  const pick = (values) => at.map((i) => values[i]);
  return {
    ...curve,
    index: at,
    hz: pick(curve.hz),
    db: pick(curve.db),
    deg: pick(curve.deg),
    reach: pick(curve.reach),
    coherence: pick(curve.coherence),
  };
}

/** Of two independent errors; one that is not known (of a model) adds nothing. @param {number} a @param {number} b */
const together = (a, b) => (Number.isNaN(a) && Number.isNaN(b) ? NaN : Math.hypot(a || 0, b || 0));

/**
 * The result at the lines, its bounds to first order; null if a curve is missing.
 *
 * @param {Operation} operation
 * @param {Partial<Record<Curves, Curve>>} curves
 * @param {number[]} lines
 * @param {number[]} at
 * @returns {Curve | null}
 */
export function computed({ kind, a: nameA, b: nameB }, curves, lines, at) {
  if (!curves[nameA] || !curves[nameB]) return null;
  const [a, b] = [atLines(curves[nameA], at), atLines(curves[nameB], at)];
  const { db, deg, reach } = kind === "ratio" ? ratio(a, b) : difference(a, b);
  const unknown = lines.map(() => NaN),
    parts = { noise: unknown, distorted: unknown };
  return { frame: null, hz: lines, index: at, db, deg: unwrapped(deg, reach), reach, ...parts, coherence: unknown };
}

/**
 * A/B: differences of dB and degrees; |δ(A/B)|/|A/B| is √(|δA/A|² + |δB/B|²).
 *
 * @param {Curve} a
 * @param {Curve} b
 */
export function ratio(a, b) {
  return {
    db: Array.from(a.db, (v, i) => v - b.db[i]),
    deg: Array.from(a.deg, (v, i) => wrapped(v - b.deg[i])),
    reach: Array.from(a.reach, (v, i) => together(v, b.reach[i])),
  };
}

/**
 * A − B as complex numbers; the squares of the bounds add.
 *
 * @param {Curve} a
 * @param {Curve} b
 */
export function difference(a, b) {
  const [one, other] = [complex(a), complex(b)];
  const re = one.re.map((v, i) => v - other.re[i]),
    im = one.im.map((v, i) => v - other.im[i]),
    size = re.map((v, i) => Math.hypot(v, im[i]));
  return {
    db: Array.from(size, (v) => 20 * Math.log10(v)),
    deg: Array.from(re, (v, i) => (Math.atan2(im[i], v) * 180) / Math.PI),
    reach: Array.from(size, (v, i) => together(one.radius[i], other.radius[i]) / v),
  };
}
