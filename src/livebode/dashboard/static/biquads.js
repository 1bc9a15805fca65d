// @ts-check
// Notch and low-pass as one biquad each at a controller's rate: those of livebode.margins.filters.

/**
 * y(n) = b0·x(n) + b1·x(n−1) + b2·x(n−2) − a1·y(n−1) − a2·y(n−2); a0 is 1.
 *
 * @typedef {{b: [number, number, number], a: [number, number]}} Biquad
 */
/** @typedef {{hz: number, depthDb: number, damping: number}} Notch */
/** @typedef {[square: number, first: number, constant: number]} Polynomial of s */

/**
 * By the bilinear transformation that is exact at a frequency (prewarped).
 *
 * @param {Polynomial} numerator
 * @param {Polynomial} denominator
 * @param {number} hz below half the rate
 * @param {number} rateHz
 * @returns {Biquad}
 */
function transformed(numerator, denominator, hz, rateHz) {
  const double = (2 * Math.PI * hz) / Math.tan((Math.PI * hz) / rateHz);
  /** p2·s² + p1·s + p0 times (1 + 1/z)²: its coefficients of 1, 1/z, 1/z². @param {Polynomial} polynomial */
  const ofDelays = ([p2, p1, p0]) => {
    const square = p2 * double ** 2,
      first = p1 * double;
    return [square + first + p0, 2 * (p0 - square), square - first + p0];
  };
  const [b, a] = [ofDelays(numerator), ofDelays(denominator)];
  return { b: [b[0] / a[0], b[1] / a[0], b[2] / a[0]], a: [a[1] / a[0], a[2] / a[0]] };
}

/** @param {Notch} notch @param {number} rateHz */
export function notchOf({ hz, depthDb, damping }, rateHz) {
  const omega = 2 * Math.PI * hz,
    share = 10 ** (-depthDb / 20);
  return transformed([1, 2 * share * damping * omega, omega ** 2], [1, 2 * damping * omega, omega ** 2], hz, rateHz);
}

/** Of second order, 3 dB down at its corner (Butterworth). @param {number} hz @param {number} rateHz */
export function lowPassOf(hz, rateHz) {
  const omega = 2 * Math.PI * hz;
  return transformed([0, 0, omega ** 2], [1, Math.SQRT2 * omega, omega ** 2], hz, rateHz);
}

/**
 * The response at a frequency.
 *
 * @param {Biquad} biquad
 * @param {number} hz
 * @param {number} rateHz
 * @returns {[re: number, im: number]}
 */
export function at({ b, a }, hz, rateHz) {
  const turn = (-2 * Math.PI * hz) / rateHz,
    [c1, s1, c2, s2] = [Math.cos(turn), Math.sin(turn), Math.cos(2 * turn), Math.sin(2 * turn)];
  const above = [b[0] + b[1] * c1 + b[2] * c2, b[1] * s1 + b[2] * s2],
    below = [1 + a[0] * c1 + a[1] * c2, a[0] * s1 + a[1] * s2],
    size = below[0] ** 2 + below[1] ** 2;
  return [(above[0] * below[0] + above[1] * below[1]) / size, (above[1] * below[0] - above[0] * below[1]) / size];
}
