// @ts-check
// The range of the phase while a response is mostly noise, such as where an axis turns round: its turns are random, and
// it does not follow them unless they last.

/** @import { Range } from "./chart.js" */
/** @import { Curve } from "./curves.js" */

const NOISE = 0.5, // of |G|: the phase is not known better than ±30°
  HOLD_MS = 2500;

/** Whether the newest response is not known at most of its lines. @param {Curve} curve */
export function mostlyNoise(curve) {
  if (curve.frame?.kind !== "newest") return false;
  let noisy = 0;
  for (const reach of curve.reach) if (!(reach < NOISE)) noisy++;
  return 2 * noisy > curve.reach.length;
}

export class NoiseHold {
  /** @type {Range | null} */
  kept = null;
  since = NaN;

  /**
   * @param {boolean} noise
   * @param {() => Range} follow the range of what is drawn
   */
  range(noise, follow) {
    const now = performance.now();
    this.since = noise ? (Number.isNaN(this.since) ? now : this.since) : NaN;
    if (!this.kept || !(now - this.since < HOLD_MS)) this.kept = follow();
    return this.kept;
  }
}
