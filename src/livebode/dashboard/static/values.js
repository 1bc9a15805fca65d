// @ts-check
// Frequencies, magnitudes and angles of the Bode plot for people, in the units of its view.
import { fixed, hertz, plain, signed } from "./words.js";

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

/**
 * The bounds of a magnitude.
 *
 * @param {number} low dB
 * @param {number} value dB
 * @param {number} high dB
 * @param {View} view
 */
export const bounds = (low, value, high, view) =>
  view.absolute
    ? `${plain(10 ** (low / 20), 3)} … ${plain(10 ** (high / 20), 3)}`
    : `−${fixed(value - low, 2)} … +${fixed(high - value, 2)} dB`;
