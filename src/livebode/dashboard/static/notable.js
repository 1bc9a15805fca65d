// @ts-check
// What matters in the response that is shown: its resonances, antiresonances and crossovers.
import { extrema } from "./extrema.js";

/** @import { Bode } from "./bode.js" */
/** Frequencies in Hz; `fitted` if they are those of a fit. @typedef {{resonances: number[], antiresonances: number[], crossovers: number[], fitted: boolean}} Notable */

const MEASURED_MAX = 2; // extrema of a measured curve: the others are small

/**
 * Peaks of the measured curve, or its antiresonances; those that differ most come first.
 *
 * @param {Bode} bode
 * @param {boolean} high
 */
export function measuredPeaks({ curves: { measured } }, high) {
  if (!measured) return [];
  const { hz, db, reach } = measured;
  return extrema(hz, db, reach, high).sort((a, b) => (high ? b.db - a.db : a.db - b.db));
}

/** Those of the fit, or else of the measured curve. @param {Bode} bode @returns {Notable} */
export function notable(bode) {
  const [low, high] = [bode.lines[0], bode.lines[bode.lines.length - 1]],
    modes = bode.known.modes().filter(({ hz }) => hz >= low && hz <= high);
  const within = bode.known
    .margins()
    .filter(({ name, hz }) => name !== "gain_margin" && name !== "gain_reduction" && hz >= low && hz <= high);
  const crossovers = within.map(({ hz }) => hz);
  if (modes.length) {
    const of = (/** @type {boolean} */ peak) => modes.filter((mode) => mode.peak === peak).map(({ hz }) => hz);
    return { resonances: of(true), antiresonances: of(false), crossovers, fitted: true };
  }
  const of = (/** @type {boolean} */ peak) =>
    measuredPeaks(bode, peak)
      .slice(0, MEASURED_MAX)
      .map(({ hz }) => hz);
  return { resonances: of(true), antiresonances: of(false), crossovers, fitted: false };
}
