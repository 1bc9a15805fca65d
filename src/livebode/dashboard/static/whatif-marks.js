// @ts-check
// The margins of L·C: in words for the menu, and marked in the plot.
import { halfDeg, highDb } from "./frames.js";
import { tr } from "./language.js";
import { marginsOf, tried } from "./whatif.js";
import { fixed, hertz, signed } from "./words.js";

/** @import { Bode } from "./bode.js" */
/** @import { Mark } from "./marks.js" */
/** @import { Filter, Margin } from "./whatif.js" */

/** @param {Margin} margin */
function wordsOf({ kind, hz, value, reach }) {
  const at = hertz(Number(hz.toPrecision(3)));
  if (kind === "gain") {
    const around = reach < 1 ? ` ± ${fixed(highDb(0, reach), 2)}` : "";
    return tr("gain may change by {value} dB at {hz} Hz", { value: signed(value, 2) + around, hz: at });
  }
  const around = reach < 1 ? ` ± ${fixed(halfDeg(reach), 1)}` : "";
  return tr("phase margin {value}° at {hz} Hz", { value: signed(value, 1) + around, hz: at });
}

/** From the fitted model if it is visible, otherwise from the lines. @param {Bode} bode @param {Filter} filter */
function found(bode, filter) {
  const model = bode.shown.has("model") ? bode.curves.model : undefined,
    from = model ?? bode.curves.measured;
  const loop = from?.frame && tried(from, from.frame.quantity, filter);
  return loop ? { model, margins: marginsOf(loop.hz, loop.db, loop.deg, loop.reach) } : null;
}

/** @param {Bode} bode @param {Filter} filter */
export function triedWords(bode, filter) {
  if (bode.quantity !== "open loop") return tr("Margins are shown with the open loop.");
  const of = found(bode, filter);
  if (!of) return "";
  const source = of.model ? tr("From the fitted model") : tr("From the measured lines, ±3σ");
  const none = tr("no crossing within the band");
  return `${source}: ${of.margins.map(wordsOf).join("; ") || none}`;
}

/**
 * Marks of the margins of L·C; none without a filter, or where its curve is hidden.
 *
 * @param {Bode} bode
 * @returns {Mark[]}
 */
export function triedMarks(bode) {
  if (!bode.filter || !bode.drawn["what if"] || !bode.shown.has("what if")) return [];
  return (found(bode, bode.filter)?.margins ?? []).map((margin) => ({
    name: `what if ${margin.kind}`,
    of: "what if",
    chart: margin.kind === "gain" ? 0 : 1,
    hz: margin.hz,
    level: margin.kind === "gain" ? -margin.value : margin.value,
    value: margin.value,
    words: tr("what if: {margin}", { margin: wordsOf(margin) }),
  }));
}
