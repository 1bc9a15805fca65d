// @ts-check
// Frequencies, magnitudes and angles of the Bode plot for people, in the units of its view.
import { fixed, hertz, places, plain, signed } from "./words.js";

/** @import { View } from "./view.js" */

/**
 * @param {number} hz
 * @param {View} view
 */
export const frequency = (hz, view) => (view.perHz === 1 ? `${hertz(hz)} Hz` : `${hertz(hz * view.perHz)} rad/s`);

/**
 * @param {number} db
 * @param {View} view
 */
export const level = (db, view) => (view.absolute ? plain(10 ** (db / 20)) : `${signed(db, 2)} dB`);

/** @param {number} deg */
export const angle = (deg) => `${signed(deg, 1)}°`;

/** @param {number} half in ° */
export const halfAngle = (half) => `± ${fixed(half, places(half, 1))}°`;

const RATIO_DIGITS = 3;
/**
 * The bounds of a magnitude, with as many digits as show their distance.
 *
 * @param {number} low dB
 * @param {number} value dB
 * @param {number} high dB
 * @param {View} view
 */
export function bounds(low, value, high, view) {
  if (!view.absolute) {
    const digits = places(Math.min(value - low, high - value), 2);
    return `−${fixed(value - low, digits)} … +${fixed(high - value, digits)} dB`;
  }
  const [least, most] = [10 ** (low / 20), 10 ** (high / 20)],
    digits = Math.max(RATIO_DIGITS, 1 + places((most - least) / most, 0));
  return `${plain(least, digits)} … ${plain(most, digits)}`;
}
