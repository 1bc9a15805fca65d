// @ts-check
// A raw signal or its spectrum in words.
import { tr, trn } from "./language.js";
import { frequency } from "./values.js";
import { fixed, plain } from "./words.js";

/** @import { Signal, Spectrum } from "./signal-answer.js" */
/** @import { View } from "./view.js" */

/**
 * What is conspicuous in a channel.
 *
 * @param {Signal & Spectrum} channel
 * @param {boolean} spectrum
 */
export function remark({ missing, constant, limit, limited, unit, points }, spectrum) {
  const found = [];
  if (missing) found.push(trn("{n} sample missing or not a number", "{n} samples missing or not a number", missing));
  if (constant) found.push(tr("constant"));
  if (limit !== null && limited)
    found.push(tr("cut off at {value} {unit}: {n} samples", { value: plain(limit), unit, n: limited }));
  if (spectrum && !points) found.push(tr("no spectrum: two windows without a gap are required"));
  return found.join(" · ");
}

/**
 * Length and resolution of a spectrum; nothing of a signal over time.
 *
 * @param {Spectrum} channel
 * @param {View} view
 */
export function resolution({ seconds, resolution_hz: hz }, { perHz }) {
  if (!hz) return "";
  const width = `${plain(hz * perHz, 3)} ${perHz === 1 ? "Hz" : "rad/s"}`;
  return tr("{seconds} s, resolution {resolution}", { seconds: fixed(seconds, 2), resolution: width });
}

/**
 * Lowest and highest value of a signal.
 *
 * @param {Signal} channel
 */
export function span({ value, unit }) {
  const known = value.filter(Number.isFinite);
  if (!known.length) return "";
  const low = known.reduce((a, b) => Math.min(a, b)),
    high = known.reduce((a, b) => Math.max(a, b));
  const reach = tr("{from} to {to}", { from: plain(low), to: plain(high) });
  return `${reach} ${unit}`;
}

/**
 * The largest amplitude of a spectrum.
 *
 * @param {Spectrum} channel
 * @param {View} view
 */
export function highest({ hz, high, points, unit }, view) {
  if (!points) return "";
  const peak = high.reduce((best, v, i) => (v > high[best] ? i : best), 0);
  return tr("highest {level} at {frequency}", {
    level: `${plain(high[peak])} ${unit}`,
    frequency: frequency(hz[peak], view),
  });
}
