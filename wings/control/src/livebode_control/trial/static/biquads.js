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

/** Cosine and sine of −2π·f/rate and of twice that, at each frequency. @typedef {Record<"c1" | "s1" | "c2" | "s2", Float64Array>} Turns */
/** @type {WeakMap<ArrayLike<number>, Turns & {rateHz: number}>} */
const known = new WeakMap();

/** The frequencies are the same in each frame while a slider moves. @param {ArrayLike<number>} hz @param {number} rateHz @returns {Turns} */
function turnsOf(hz, rateHz) {
  const before = known.get(hz);
  if (before?.rateHz === rateHz && before.c1.length === hz.length) return before;
  const [c1, s1, c2, s2] = [0, 0, 0, 0].map(() => new Float64Array(hz.length));
  for (let i = 0; i < hz.length; i++) {
    const turn = (-2 * Math.PI * hz[i]) / rateHz;
    c1[i] = Math.cos(turn);
    s1[i] = Math.sin(turn);
    c2[i] = Math.cos(2 * turn);
    s2[i] = Math.sin(2 * turn);
  }
  const made = { rateHz, c1, s1, c2, s2 };
  known.set(hz, made);
  return made;
}

/**
 * Multiply values by the response of a biquad, without an allocation per frequency, and add its phase to `rad`.
 *
 * @param {Biquad} biquad
 * @param {ArrayLike<number>} hz
 * @param {number} rateHz
 * @param {{re: Float64Array, im: Float64Array, rad?: Float64Array}} values
 */
export function filter({ b: [b0, b1, b2], a: [a1, a2] }, hz, rateHz, { re, im, rad }) {
  const { c1, s1, c2, s2 } = turnsOf(hz, rateHz);
  for (let i = 0; i < re.length; i++) {
    const p = b0 + b1 * c1[i] + b2 * c2[i],
      q = b1 * s1[i] + b2 * s2[i],
      u = 1 + a1 * c1[i] + a2 * c2[i],
      v = a1 * s1[i] + a2 * s2[i],
      size = u * u + v * v;
    const c = (p * u + q * v) / size,
      d = (q * u - p * v) / size,
      before = re[i];
    re[i] = before * c - im[i] * d;
    im[i] = before * d + im[i] * c;
    if (rad) rad[i] += Math.atan2(d, c);
  }
}
