// @ts-check
// Ticks of the Bode plot's axes in the units of the view; positions remain Hz and dB.
import { axis, degreeTicks, frequencyTicks, letters } from "./chart.js";
import { tr } from "./language.js";
import { hertz, mark, plain } from "./words.js";

/** @import { View } from "./view.js" */

/** Width of the axes on the left: one for all charts, so that a frequency has one place. @param {View} view */
export const left = (view) => letters() * (view.absolute ? 52 : 44);
const STEP_PX = 60,
  ROW_PX = 26;

/**
 * Round numbers between two, evenly spaced.
 *
 * @param {number} low
 * @param {number} high
 * @param {number} most
 */
export function evenly(low, high, most) {
  const least = (high - low) / Math.max(1, most),
    decade = 10 ** Math.floor(Math.log10(least)),
    step = decade * ([1, 2, 5].find((m) => m * decade >= least) ?? 10);
  const found = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high * (1 + 1e-12); i++) found.push(i * step);
  return found;
}

/**
 * @param {() => number[]} lines
 * @param {View} view
 * @param {boolean} last
 */
export function frequencyAxis(lines, view, last) {
  const { perHz, linear } = view;
  const decades = frequencyTicks(() => lines().map((f) => f * perHz));
  return axis(last ? (perHz === 1 ? tr("frequency in Hz") : tr("angular frequency in rad/s")) : "", {
    size: last ? 26 * letters() : 8,
    labelSize: last ? 18 * letters() : 0,
    splits: (u, i, low, high, ...rest) => {
      const most = u.bbox.width / devicePixelRatio / (STEP_PX * letters());
      const found = linear
        ? evenly(low * perHz, high * perHz, most)
        : decades(u, i, low * perHz, high * perHz, ...rest);
      return found.map((f) => f / perHz);
    },
    filter: (_u, splits) => splits,
    values: (_u, splits) => splits.map((f) => (last ? hertz(f * perHz) : "")),
  });
}

/**
 * @param {uPlot.Axis.Label} label
 * @param {View} view
 */
export function magnitudeAxis(label, view) {
  const size = left(view);
  if (!view.absolute) return axis(label, { size, values: (_u, s) => s.map(mark) });
  return axis(label, {
    size,
    splits: (u, _axis, low, high) => decadesOf(low, high, u.bbox.height / devicePixelRatio / (ROW_PX * letters())),
    filter: (_u, splits) => splits,
    values: (_u, splits) => splits.map((db) => plain(10 ** (db / 20), 3)),
  });
}

/** @param {string} label @param {View} view */
export const phaseAxis = (label, view) =>
  axis(label, { size: left(view), values: (_u, s) => s.map(mark), splits: degreeTicks });

/**
 * dB of round absolute values.
 *
 * @param {number} low
 * @param {number} high
 * @param {number} most
 */
function decadesOf(low, high, most) {
  const from = Math.floor(low / 20),
    to = Math.ceil(high / 20);
  for (const mantissas of [[1, 2, 3, 4, 5, 6, 7, 8, 9], [1, 2, 5], [1, 3], [1]]) {
    const found = [];
    for (let d = from; d <= to; d++)
      for (const m of mantissas) {
        const db = 20 * (d + Math.log10(m));
        if (db >= low && db <= high) found.push(db);
      }
    if (found.length >= 2 && found.length <= most) return found;
  }
  // Less than a decade is visible, or so many that only some have a tick.
  if (to - from < 3)
    return evenly(10 ** (low / 20), 10 ** (high / 20), most)
      .filter((v) => v > 0)
      .map((v) => 20 * Math.log10(v));
  const every = Math.ceil((to - from) / most);
  return Array.from({ length: to - from + 1 }, (_, i) => 20 * (from + i)).filter(
    (db) => db >= low && db <= high && (db / 20) % every === 0,
  );
}
