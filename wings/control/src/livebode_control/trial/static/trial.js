// @ts-check
// A trial: other gains and filters for the described loop, and the controller F that they give. Nothing of it is recorded;
// the server sends the controllers as curves (loop_trials.py), so that F needs no request.
import { filter, lowPassOf, notchOf } from "./biquads.js";

/** @import { Biquad, Notch } from "./biquads.js" */
/** @import { Curve, Numbers } from "./curves.js" */
/** @import { LoopFacts, LoopParts, LoopTerm } from "./loop.js" */
/** `values` are those that differ from the described ones; a corner and a delay of zero are without them. @typedef {{values: Record<string, number>, notches: Notch[], lowPassHz: number, delayMs: number}} Trial */
/** @typedef {{re: Float64Array, im: Float64Array}} Complexes */

export const NOTCHES_MAX = 4;
/** @returns {Trial} */
export const nothing = () => ({ values: {}, notches: [], lowPassHz: 0, delayMs: 0 });

/** @param {Trial} trial */
export const isNothing = ({ values, notches, lowPassHz, delayMs }) =>
  !Object.keys(values).length && !notches.length && !lowPassHz && !delayMs;

/** @param {Trial} trial @param {number} rateHz @returns {Biquad[]} */
export const biquadsOf = ({ notches, lowPassHz }, rateHz) => [
  ...notches.map((notch) => notchOf(notch, rateHz)),
  ...(lowPassHz ? [lowPassOf(lowPassHz, rateHz)] : []),
];

/** @param {LoopTerm} term @param {Record<string, number>} values */
const weight = ({ name, power }, values) => (name ? values[name] ** power : 1);

/**
 * The controllers without filters: F = gain·(sum of the terms)·(1 + outer).
 *
 * @param {LoopParts} parts
 * @param {Record<string, number>} values
 * @returns {Complexes}
 */
export function controllers({ terms, outer }, values) {
  const count = terms[0].re.length,
    [re, im] = [new Float64Array(count), new Float64Array(count)];
  for (const term of terms) {
    const by = values.gain * weight(term, values);
    for (let i = 0; i < count; i++) {
      re[i] += by * term.re[i];
      im[i] += by * term.im[i];
    }
  }
  if (outer) {
    const by = weight(outer, values);
    for (let i = 0; i < count; i++) {
      const [c, d] = [1 + by * outer.re[i], by * outer.im[i]];
      [re[i], im[i]] = [re[i] * c - im[i] * d, re[i] * d + im[i] * c];
    }
  }
  return { re, im };
}

/**
 * F with its filters and its additional delay.
 *
 * @param {LoopParts} parts
 * @param {Numbers} hz
 * @param {LoopFacts} facts
 * @param {Trial} trial
 * @returns {Complexes}
 */
export function feedback(parts, hz, facts, trial) {
  const found = controllers(parts, { ...facts.values, ...trial.values });
  for (const biquad of biquadsOf(trial, facts.rate_hz)) filter(biquad, hz, facts.rate_hz, found);
  if (trial.delayMs) delay(trial.delayMs, hz, found);
  return found;
}

/** Multiply values by the response of a delay, and add its phase to `rad`. @param {number} ms @param {Numbers} hz @param {Complexes & {rad?: Float64Array}} values */
function delay(ms, hz, { re, im, rad }) {
  for (let i = 0; i < re.length; i++) {
    const late = (-2 * Math.PI * hz[i] * ms) / 1000,
      c = Math.cos(late),
      d = Math.sin(late),
      before = re[i];
    re[i] = before * c - im[i] * d;
    im[i] = before * d + im[i] * c;
    if (rad) rad[i] += late;
  }
}

/** The described controllers at the frequencies of the page. @type {WeakMap<LoopFacts, Complexes>} */
const described = new WeakMap();

/** @param {LoopFacts} facts */
function describedOf(facts) {
  const found = described.get(facts) ?? controllers(facts.parts, facts.values);
  described.set(facts, found);
  return found;
}

/** @typedef {Complexes & {deg: Float64Array}} Factor with its phase without jumps of whole turns */

/**
 * C = F of the trial over the described F, at the frequencies of a curve.
 *
 * @param {LoopFacts} facts
 * @param {Trial} trial
 * @param {Pick<Curve, "hz" | "index">} curve its `index` is that in the frequencies of the facts
 * @returns {Factor}
 */
export function factor(facts, trial, { hz, index }) {
  const before = describedOf(facts),
    after = controllers(facts.parts, { ...facts.values, ...trial.values }),
    [re, im, rad] = [0, 0, 0].map(() => new Float64Array(hz.length));
  // Each factor but the delay is within half a turn.
  for (let i = 0; i < hz.length; i++) {
    const k = index[i],
      [a, b, c, d] = [after.re[k], after.im[k], before.re[k], before.im[k]],
      size = c * c + d * d;
    re[i] = (a * c + b * d) / size;
    im[i] = (b * c - a * d) / size;
    rad[i] = Math.atan2(im[i], re[i]);
  }
  const found = { re, im, rad };
  for (const biquad of biquadsOf(trial, facts.rate_hz)) filter(biquad, hz, facts.rate_hz, found);
  if (trial.delayMs) delay(trial.delayMs, hz, found);
  return { re, im, deg: rad.map((v) => (v * 180) / Math.PI) };
}

const round = (/** @type {number} */ v) => String(Number(v.toPrecision(6)));

/** A trial for the address of the page. @param {Trial} trial */
export function textOf({ values, notches, lowPassHz, delayMs }) {
  return [
    ...Object.entries(values).map(([name, v]) => `${name}~${round(v)}`),
    ...notches.map(({ hz, depthDb, damping }) => ["notch", ...[hz, depthDb, damping].map(round)].join("~")),
    ...(lowPassHz ? [`low-pass~${round(lowPassHz)}`] : []),
    ...(delayMs ? [`delay~${round(delayMs)}`] : []),
  ].join("~~");
}

/** @param {string} text @returns {Trial} */
export function trialOf(text) {
  const trial = nothing();
  for (const part of text.split("~~").filter(Boolean)) {
    const [name, ...rest] = part.split("~"),
      [first, second, third] = rest.map(Number);
    if (!rest.length || !rest.every((v) => v !== "" && Number.isFinite(Number(v)))) return nothing();
    if (name === "notch" && rest.length === 3 && first > 0 && third > 0 && trial.notches.length < NOTCHES_MAX)
      trial.notches.push({ hz: first, depthDb: second, damping: third });
    else if (name === "low-pass") trial.lowPassHz = Math.max(0, first);
    else if (name === "delay") trial.delayMs = Math.max(0, first);
    else if (first) trial.values[name] = first;
  }
  return trial;
}
