// @ts-check
// The parts of a bound: noise, distortion and time variation. Each is drawn around those before it, whose squares add.
import { tr } from "./language.js";

/** @import { Curve, Numbers } from "./curves.js" */
/**
 * @typedef {object} Part
 * @property {string} words
 * @property {string} ink its colour in look.css
 * @property {number} width of its bar, px
 * @property {(curve: Curve) => Numbers} reach of this part and those before it
 */

/** @typedef {Part & {i: number}} Shown */

/** @type {Part[]} */
export const PARTS = [
  { words: tr("noise"), ink: "measured", width: 6, reach: ({ noise }) => noise },
  { words: tr("distortion"), ink: "t3", width: 3.6, reach: ({ distorted }) => distorted },
  { words: tr("time variation"), ink: "t7", width: 1.6, reach: ({ reach }) => reach },
];
const SEEN = 0.995, // of the reach: what adds less is not seen
  SAME = 1 - 1e-6; // two numbers that travelled as float32

/** Whether a part adds to a bound that a person can see, at a line. @param {Curve} curve @param {number} part @param {number} i */
const adds = (curve, part, i) => PARTS[part - 1].reach(curve)[i] < SEEN * PARTS[part].reach(curve)[i];

/** The parts besides noise that a curve has. @param {Curve} curve */
export const others = (curve) => [1, 2].filter((part) => curve.hz.some((_, i) => adds(curve, part, i)));

/** The parts that a legend, a table and the read-out have. @param {Set<number>} known those besides noise */
export const shown = (known) => PARTS.map((part, i) => ({ ...part, i })).filter(({ i }) => i === 0 || known.has(i));

/** What is drawn at a line, from the outside: each part with its reach. @param {Curve} curve @param {number} i */
export const drawnAt = (curve, i) =>
  [2, 1, 0]
    .filter((part) => part === 0 || adds(curve, part, i))
    .map((part) => ({ ...PARTS[part], reach: PARTS[part].reach(curve)[i] }));

/** The reach of each part alone, at a line. @param {Curve} curve @param {number} i */
export const aloneAt = (curve, i) =>
  PARTS.map(({ reach }, part) => {
    const [all, before] = [reach(curve)[i], part ? PARTS[part - 1].reach(curve)[i] : 0];
    return before > SAME * all ? 0 : Math.sqrt(all * all - before * before);
  });
