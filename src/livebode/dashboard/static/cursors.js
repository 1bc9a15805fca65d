// @ts-check
// The fixed cursors A and B of the Bode plot, in the address.
import { chosen, remember } from "./address.js";

/** @import { Found, Curves } from "./messages.js" */

const DOUBLE_MS = 700;

/** @param {string} text */
const hzOf = (text) => (Number(text) > 0 ? Number(text) : null);

export class Cursors {
  constructor() {
    /** Frequencies, Hz; null where the cursor is not placed. @type {[a: number | null, b: number | null]} */
    this.hz = [hzOf(chosen("bode-a", "")), hzOf(chosen("bode-b", ""))];
    /** @type {[a: number | null, b: number | null]} */
    this.before = [...this.hz];
    this.placedMs = -DOUBLE_MS;
  }

  /**
   * @param {boolean} second
   * @param {number} hz
   */
  place(second, hz) {
    const now = performance.now();
    if (now - this.placedMs > DOUBLE_MS) this.before = [...this.hz];
    this.placedMs = now;
    this.hz[second ? 1 : 0] = hz;
    this.note();
  }

  // What was placed just now were the clicks of a double click, which asks for something else.
  undo() {
    if (performance.now() - this.placedMs > DOUBLE_MS) return;
    this.hz = [...this.before];
    this.note();
  }

  clear() {
    this.hz = [null, null];
    this.note();
  }

  note() {
    for (const [i, name] of ["bode-a", "bode-b"].entries()) remember(name, String(this.hz[i] ?? ""), "");
  }
}

/**
 * B less A of each curve: dB, degrees, and the ratio of the magnitudes.
 *
 * @param {Found} a
 * @param {Found} b
 */
export function differences(a, b) {
  return /** @type {Curves[]} */ (Object.keys(a)).flatMap((name) => {
    const [one, other] = [a[name], b[name]];
    if (!one || !other) return [];
    const db = other.db - one.db;
    return [{ name, db, deg: other.deg - one.deg, ratio: 10 ** (db / 20) }];
  });
}
