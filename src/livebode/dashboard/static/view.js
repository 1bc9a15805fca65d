// @ts-check
// How the Bode plot shows its curves: units, scales, delay, derivative or integral. Chosen in the address.
import { chosen, remember } from "./address.js";
import { tr } from "./language.js";
import { fixed, signed } from "./words.js";

/** @import { Curve, Numbers } from "./curves.js" */
/** @import { SourceUnits } from "./messages.js" */
/** @typedef {{db: Numbers, deg: Numbers}} Viewing Magnitude and phase of a curve in the view. */

export const OPTIONS = /** @type {const} */ ({
  frequency: ["log", "linear"],
  unit: ["hz", "rad"],
  magnitude: ["db", "absolute"],
  phase: ["unwrapped", "wrapped"],
  power: ["0", "1", "2", "-1", "-2"],
  units: ["si", "drive"],
  bound: ["parts", "whole"],
});
/** @typedef {keyof typeof OPTIONS} Option */

const DELAY_MS_MAX = 10_000;

/** The name of an option in the address, which other parts share. @param {string} option */
const inAddress = (option) => `bode-${option}`;

export class View {
  constructor() {
    /** @type {Record<Option, string>} */
    this.options = /** @type {Record<Option, string>} */ ({});
    for (const option of /** @type {Option[]} */ (Object.keys(OPTIONS)))
      this.options[option] = chosen(inAddress(option), OPTIONS[option][0], OPTIONS[option]);
    const ms = Number(chosen(inAddress("delay"), "0"));
    this.delayMs = Math.abs(ms) <= DELAY_MS_MAX ? ms : 0;
    /** Of the quantity that is shown, if they are not SI units. @type {SourceUnits | null} */
    this.drive = null;
  }

  /**
   * @param {Option} option
   * @param {string} value
   */
  choose(option, value) {
    this.options[option] = value;
    remember(inAddress(option), value, OPTIONS[option][0]);
  }

  /** @param {number} ms */
  removeDelay(ms) {
    this.delayMs = Math.max(-DELAY_MS_MAX, Math.min(DELAY_MS_MAX, Number.isFinite(ms) ? ms : 0));
    remember(inAddress("delay"), String(this.delayMs), "0");
  }

  get power() {
    return Number(this.options.power);
  }

  get linear() {
    return this.options.frequency === "linear";
  }

  get wrapped() {
    return this.options.phase === "wrapped";
  }

  get absolute() {
    return this.options.magnitude === "absolute";
  }

  get inParts() {
    return this.options.bound === "parts";
  }

  get inDrive() {
    return this.options.units === "drive";
  }

  // How far the displayed magnitudes are above those in SI units.
  get aboveDb() {
    return this.inDrive && this.drive ? this.drive.db : 0;
  }

  // Displayed units of angular frequency or frequency in one Hz.
  get perHz() {
    return this.options.unit === "rad" ? 2 * Math.PI : 1;
  }

  // Whether the curves are shown as they are, so that crossings of 0 dB and −180° are those of the loop.
  get plain() {
    return this.power === 0 && this.delayMs === 0;
  }

  // What was done to the curves, for a title; empty if nothing was.
  get words() {
    const found = [];
    if (this.inDrive && this.drive) found.push(tr("units of the drive: SI {db} dB", { db: signed(this.drive.db, 2) }));
    if (this.power > 0) found.push(tr("multiplied by (jω)^{n}", { n: String(this.power) }));
    if (this.power < 0) found.push(tr("divided by (jω)^{n}", { n: String(-this.power) }));
    if (this.delayMs) found.push(tr("delay of {ms} ms removed", { ms: fixed(this.delayMs, 3) }));
    if (this.wrapped) found.push(tr("phase wrapped"));
    return found.join(", ");
  }

  /**
   * A curve in this view. Its relative bounds are those of the curve: the factor is exact.
   *
   * @param {Curve} curve
   * @param {boolean} ratio of two curves, in which factors and delay cancel
   * @returns {Viewing}
   */
  of(curve, ratio = false) {
    const { hz, db, deg, reach } = curve,
      power = ratio ? 0 : this.power,
      aboveDb = ratio ? 0 : this.aboveDb,
      delayS = ratio ? 0 : this.delayMs / 1000;
    const level = power || aboveDb ? hz.map((f, i) => db[i] + aboveDb + 20 * power * Math.log10(2 * Math.PI * f)) : db;
    /** @type {Numbers} */
    let angle = deg;
    if (power || delayS) angle = hz.map((f, i) => deg[i] + 90 * power + 360 * f * delayS);
    if (delayS) angle = unwrapped(angle, reach);
    if (this.wrapped) angle = Array.from(angle, wrapped);
    return { db: level, deg: angle };
  }
}

/** The same angle between −180° (not included) and 180°. @param {number} deg */
export const wrapped = (deg) => deg - 360 * Math.ceil(deg / 360 - 0.5);

/**
 * Phase along frequency without jumps of whole turns. Values that cannot be distinguished from zero follow the others,
 * so that noise adds no turn.
 *
 * @param {Numbers} deg
 * @param {Numbers} reach
 * @returns {number[]}
 */
export function unwrapped(deg, reach) {
  const found = Array.from(deg);
  let last = NaN;
  for (let i = 0; i < found.length; i++) {
    if (!Number.isFinite(found[i])) continue;
    if (Number.isFinite(last)) found[i] -= 360 * Math.round((found[i] - last) / 360);
    if (!(reach[i] >= 1)) last = found[i];
  }
  return found;
}
