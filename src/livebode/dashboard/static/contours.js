// @ts-check
// Where the closed loop has one magnitude, in the plane of the open loop L: Hall's circles (M-circles) of T = L/(1 + L)
// and S = 1/(1 + L). James, Nichols and Phillips, Theory of Servomechanisms, 1947, chapter 4.

/** @typedef {{re: number, im: number, radius: number}} Circle */

/**
 * The circle of |L/(1 + L)| = m; m = 1 is the line Re L = −1/2, which is no circle.
 *
 * @param {number} m
 * @returns {Circle}
 */
export const circleT = (m) => ({ re: -(m * m) / (m * m - 1), im: 0, radius: m / Math.abs(m * m - 1) });

/**
 * The circle of |1/(1 + L)| = m.
 *
 * @param {number} m
 * @returns {Circle}
 */
export const circleS = (m) => ({ re: -1, im: 0, radius: 1 / m });

/**
 * Points of |L/(1 + L)| = m as phase in degrees from −360 to 0 and magnitude in dB: L = T/(1 − T) with |T| = m.
 *
 * @param {number} m
 * @param {number} count
 * @returns {[deg: number, db: number][]}
 */
export function nicholsT(m, count) {
  return Array.from({ length: count }, (_, i) => {
    // Not at the ends, where L is infinite if m = 1.
    const angle = (2 * Math.PI * (i + 0.5)) / count,
      [tr, ti] = [m * Math.cos(angle), m * Math.sin(angle)],
      below = (1 - tr) ** 2 + ti ** 2,
      [re, im] = [(tr * (1 - tr) - ti * ti) / below, ti / below],
      deg = (Math.atan2(im, re) * 180) / Math.PI;
    return [deg > 0 ? deg - 360 : deg, 20 * Math.log10(Math.hypot(re, im))];
  });
}

/**
 * The edge of the circle of the bound around a value, as phase in degrees and magnitude in dB. It is closed if it is
 * smaller than the value. Otherwise the circle contains zero, and everything below the edge is within the bound.
 *
 * @param {number} deg
 * @param {number} db
 * @param {number} reach bound/|value|
 * @param {number} count
 * @returns {[deg: number, db: number][]}
 */
export function nicholsBound(deg, db, reach, count) {
  return Array.from({ length: count + 1 }, (_, i) => {
    const angle = -Math.PI + (2 * Math.PI * i) / count,
      [re, im] = [1 + reach * Math.cos(angle), reach * Math.sin(angle)];
    return [deg + (Math.atan2(im, re) * 180) / Math.PI, db + 20 * Math.log10(Math.hypot(re, im))];
  });
}
