// @ts-check
// The result of the measurement in one line, from the fit that is drawn; without a fit from the measured curve.
import { moment } from "./clock.js";
import { tr, trn } from "./language.js";
import { measuredPeaks } from "./notable.js";
import { bounded } from "./trends.js";
import { frequency, level } from "./values.js";
import { hertz, plain } from "./words.js";

/** @import { Bode } from "./bode.js" */
/** @import { Run } from "./messages.js" */
/** @import { Trends } from "./trends.js" */

const MODES_MAX = 2,
  PARAMETERS_MAX = 2,
  DIGITS = 2;

/**
 * @param {Run} facts
 * @param {Bode} bode
 * @param {Trends} parameters
 */
export function resultWords(facts, bode, parameters) {
  const { measured, model } = bode.curves;
  if (!measured) return "";
  const fitted = model ? fittedWords(bode, parameters) : "";
  if (!fitted) return measuredWords(bode);
  const [at, of] = [measured.frame?.timeS[0] ?? NaN, model?.frame?.timeS[0] ?? NaN],
    other = Math.abs(at - of) > facts.window / facts.rate_hz;
  return other ? tr("{result}, at {time}", { result: fitted, time: moment(of, true) }) : fitted;
}

/** @param {Bode} bode @param {Trends} parameters */
function fittedWords(bode, parameters) {
  const modes = bode.known.modes().filter(({ peak }) => peak);
  const damping = (/** @type {number} */ ratio) => plain(100 * ratio, DIGITS);
  if (modes.length === 1) {
    const [{ value, damping: ratio }] = modes;
    return tr("Resonance {hz}, damping {percent} %", { hz: value, percent: damping(ratio) });
  }
  if (modes.length) {
    const words = modes.slice(0, MODES_MAX).map(({ value, damping: ratio }) => `${value} (${damping(ratio)} %)`);
    const more = modes.length - words.length;
    const list = words.join(", ");
    if (!more) return tr("Resonances (damping) {list}", { list });
    return tr("Resonances (damping) {list} and {more} more", { list, more });
  }
  return [...parameters.items.values()]
    .filter(({ shown }) => shown && Number.isFinite(shown.v) && shown.s > 0)
    .slice(0, PARAMETERS_MAX)
    .map(({ name, unit, shown }) => `${parameters.title(name)} ${bounded(shown?.v ?? NaN, shown?.s ?? NaN, unit)}`)
    .join(", ");
}

/** @param {Bode} bode */
function measuredWords(bode) {
  const { lines, view, symbol } = bode,
    count = lines.length,
    band = `${hertz(lines[0])} … ${frequency(lines[count - 1], view)}`;
  const [peak] = measuredPeaks(bode, true);
  if (peak)
    return tr("Largest peak of |{symbol}| between {low} and {high}: {level}", {
      symbol,
      low: hertz(peak.lowHz),
      high: frequency(peak.highHz, view),
      level: level(peak.db, view),
    });
  return trn(
    "Response {symbol} at {n} line, {band}: no peak",
    "Response {symbol} at {n} lines, {band}: no peak",
    count,
    {
      symbol,
      band,
    },
  );
}
