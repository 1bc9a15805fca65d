// @ts-check
// The newest responses: times, schedule, and for each line magnitude, phase, reach and coherence; a ring buffer of bounded size.

/** @import { Frame, History } from "./messages.js" */

const ROWS_MAX = 2400,
  CELLS_MAX = 1 << 20;

export class Rows {
  /** @param {number} columns */
  constructor(columns) {
    this.columns = columns;
    this.room = Math.max(64, Math.min(ROWS_MAX, Math.floor(CELLS_MAX / columns)));
    this.count = 0;
    this.next = 0;
    this.timeS = new Float64Array(this.room);
    this.schedule = new Float64Array(this.room);
    this.magnitude = new Float32Array(this.room * columns);
    this.phase = new Float32Array(this.room * columns);
    this.reach = new Float32Array(this.room * columns);
    this.coherence = new Float32Array(this.room * columns);
  }

  clear() {
    this.count = 0;
    this.next = 0;
  }

  /** @param {Frame} frame */
  take(frame, wanted = (/** @type {number} */ _timeS) => true) {
    for (let r = Math.max(0, frame.rows - this.room); r < frame.rows; r++)
      if (wanted(frame.timeS[r])) this.put(frame, r);
  }

  /**
   * @param {History} from
   * @param {number} r
   */
  put(from, r) {
    const at = this.next,
      begin = r * this.columns,
      end = begin + this.columns;
    this.timeS[at] = from.timeS[r];
    this.schedule[at] = from.schedule[r];
    this.magnitude.set(from.magnitude.subarray(begin, end), at * this.columns);
    this.phase.set(from.phase.subarray(begin, end), at * this.columns);
    this.reach.set(from.reach.subarray(begin, end), at * this.columns);
    this.coherence.set(from.coherence.subarray(begin, end), at * this.columns);
    this.next = (at + 1) % this.room;
    this.count = Math.min(this.count + 1, this.room);
  }

  /**
   * These rows, preceded by the older rows of a frame.
   *
   * @param {Frame} frame
   */
  behind(frame) {
    const after = new Rows(this.columns),
      first = this.count ? this.timeS[this.order()[0]] : Infinity;
    after.take(frame, (timeS) => timeS < first);
    for (const at of this.order()) after.put(this, at);
    return after;
  }

  // Indices of the rows in order of arrival.
  order() {
    const first = (this.next - this.count + this.room) % this.room;
    return Array.from({ length: this.count }, (_, i) => (first + i) % this.room);
  }

  get lastS() {
    return this.count ? this.timeS[(this.next - 1 + this.room) % this.room] : NaN;
  }
}

/**
 * Indices of the rows between two times, in order of arrival.
 *
 * @param {History} rows
 * @param {number} fromS
 * @param {number} toS
 */
export const between = (rows, fromS, toS) =>
  (rows instanceof Rows ? rows.order() : Array.from({ length: rows.rows }, (_, i) => i)).filter(
    (r) => rows.timeS[r] >= fromS && rows.timeS[r] <= toS,
  );
