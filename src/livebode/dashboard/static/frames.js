// @ts-check
// Frames from the server as typed arrays; frames.py documents the layout.

/** @import { Fits, Frame, FrameKind, Quantity, Reference } from "./messages.js" */

/** @type {Reference[]} */
export const REFERENCES = [
  "reference",
  "reference 2",
  "reference 3",
  "reference 4",
  "reference 5",
  "reference 6",
  "reference 7",
  "reference 8",
];
/** @type {(FrameKind | "fits")[]} */
const KINDS = ["newest", "moment", "reference", "baseline", "model", "rows", "history", "fits", ...REFERENCES.slice(1)];
/** @type {Quantity[]} */
export const QUANTITIES = ["plant", "open loop", "closed loop", "sensitivity"];

const TEXT = new TextDecoder();

/**
 * All frames of a message, in order.
 *
 * @param {ArrayBuffer} buffer
 * @returns {Generator<Frame | Fits, void>}
 */
export function* framesOf(buffer) {
  const view = new DataView(buffer);
  let at = 0;
  while (at + 16 <= buffer.byteLength) {
    if (view.getUint32(at) !== 0x4c424356 || view.getUint8(at + 4) !== 3)
      throw new Error("this is not a frame of curves");
    const rows = view.getUint32(at + 8, true),
      columns = view.getUint32(at + 12, true),
      cells = rows * columns;
    let next = at + 16;
    const kind = KINDS[view.getUint8(at + 5)],
      quantity = QUANTITIES[view.getUint8(at + 6)],
      axis = view.getUint8(at + 7);
    if (kind === "fits") {
      yield { kind, quantity, axis, trends: JSON.parse(TEXT.decode(new Uint8Array(buffer, next, rows))) };
      at = (next + rows + 7) & ~7;
      continue;
    }
    const doubles = () => {
      const a = new Float64Array(buffer, next, rows);
      next += 8 * rows;
      return a;
    };
    const floats = (sent = true) => {
      if (!sent) return new Float32Array(cells).fill(NaN);
      const a = new Float32Array(buffer, next, cells);
      next += 4 * cells;
      return a;
    };
    const bounded = kind !== "model",
      parts = kind === "newest" || kind === "moment";
    yield {
      kind,
      quantity,
      axis,
      rows,
      columns,
      timeS: doubles(),
      schedule: doubles(),
      dof: doubles(),
      magnitude: floats(),
      phase: floats(),
      reach: floats(bounded),
      coherence: floats(bounded),
      noise: floats(parts),
      distorted: floats(parts),
    };
    at = (next + 7) & ~7;
  }
}

/** The first curve of an answer. @param {ArrayBuffer} buffer */
export function curveIn(buffer) {
  for (const frame of framesOf(buffer)) if (frame.kind !== "fits") return frame;
  throw new Error("the answer has no curve");
}

// Edges of the 95 % bound around a magnitude in dB or a phase in degrees; see frames.py.
const FLOOR_DB = -1000;
/**
 * @param {number} db
 * @param {number} reach
 */
export const lowDb = (db, reach) => (reach < 1 ? db + 20 * Math.log10(1 - reach) : reach >= 1 ? FLOOR_DB : NaN);
/**
 * @param {number} db
 * @param {number} reach
 */
export const highDb = (db, reach) => db + 20 * Math.log10(1 + reach);
/** @param {number} reach */
export const halfDeg = (reach) => (reach < 1 ? (180 / Math.PI) * Math.asin(reach) : reach >= 1 ? 180 : NaN);
