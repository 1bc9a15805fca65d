// @ts-check
// The margins of L·C, marked in the plot.
import { halfDeg, highDb } from "./frames.js";
import { tr } from "./language.js";
import { marginsOf, tried } from "./whatif.js";
import { fixed, hertz, signed } from "./words.js";

/** @import { Bode } from "./bode.js" */
/** @import { Curve } from "./curves.js" */
/** @import { Mark } from "./marks.js" */
/** @import { Factor } from "./trial.js" */
/** @import { Margin } from "./whatif.js" */
/** @typedef {(curve: Curve) => Factor} FactorOf */

/** Short beside the sliders, where the card has the words. @param {Margin} margin @param {boolean} short */
function wordsOf({ kind, hz, value, reach }, short) {
  const at = hertz(Number(hz.toPrecision(3)));
  if (kind === "gain") {
    const around = reach < 1 ? ` ± ${fixed(highDb(0, reach), 2)}` : "",
      shown = signed(value, 2) + around;
    return short ? `${shown} dB` : tr("what if: gain may change by {value} dB at {hz} Hz", { value: shown, hz: at });
  }
  const around = reach < 1 ? ` ± ${fixed(halfDeg(reach), 1)}` : "",
    shown = signed(value, 1) + around;
  return short ? `${shown}°` : tr("what if: phase margin {value}° at {hz} Hz", { value: shown, hz: at });
}

/** From the fitted model if it is visible, otherwise from the lines. @param {Bode} bode @param {FactorOf} factor @returns {Margin[]} */
function marginsOfTrial(bode, factor) {
  const model = bode.shown.has("model") ? bode.curves.model : undefined,
    from = model ?? bode.curves.measured;
  const loop = from?.frame && tried(from, from.frame.quantity, factor(from));
  return loop ? marginsOf(loop.hz, loop.db, loop.deg, loop.reach) : [];
}

/** L·C with its margins, in the plot. */
export class TriedCurve {
  /** @param {Bode} bode */
  constructor(bode) {
    this.bode = bode;
    /** C at the frequencies of a curve; null: nothing is tried. @type {FactorOf | null} */
    this.factor = null;
    /** Whether the sliders are beside the plot. */
    this.alone = false;
    /** Margins of this drawing. @type {Mark[] | null} */
    this.drawn = null;
  }

  /** @param {Curve} measured */
  curve(measured) {
    this.drawn = null;
    return this.factor && tried(measured, measured.frame?.quantity ?? null, this.factor(measured));
  }

  /**
   * Marks of the margins of L·C; none where its curve is hidden. Computed once for each drawing: they are needed for the
   * scales and for each chart.
   */
  marks() {
    const { bode, factor } = this;
    if (!factor || !bode.drawn["what if"] || !bode.shown.has("what if")) return [];
    this.drawn ??= marginsOfTrial(bode, factor).map((margin) => ({
      name: `what if ${margin.kind}`,
      of: "what if",
      chart: margin.kind === "gain" ? 0 : 1,
      hz: margin.hz,
      level: margin.kind === "gain" ? -margin.value : margin.value,
      value: margin.value,
      words: wordsOf(margin, this.alone),
    }));
    return this.drawn;
  }
}
