// @ts-check
// Few lines as points with error bars, which may show the parts of the bound: the thickest is the noise.
import { letters } from "./chart.js";
import { halfDeg, highDb, lowDb } from "./frames.js";
import { ink, look } from "./looks.js";
import { drawnAt } from "./parts.js";
import { colour } from "./theme.js";

/** @import { Chart } from "./chart.js" */
/** @import { Curve, Values } from "./curves.js" */
/** @import { Marker } from "./looks.js" */
/** @import { Curves } from "./messages.js" */

const RADIUS = 3.6,
  CAP = 3.5;

/** @type {Record<Marker, (ctx: CanvasRenderingContext2D, x: number, y: number, r: number) => void>} */
export const MARKERS = {
  circle: (ctx, x, y, r) => ctx.arc(x, y, r, 0, 7),
  ring: (ctx, x, y, r) => ctx.arc(x, y, r, 0, 7),
  square: (ctx, x, y, r) => ctx.rect(x - r, y - r, 2 * r, 2 * r),
  diamond: (ctx, x, y, r) =>
    polygon(ctx, [
      [x, y - r],
      [x + r, y],
      [x, y + r],
      [x - r, y],
    ]),
  up: (ctx, x, y, r) =>
    polygon(ctx, [
      [x, y - r],
      [x + r, y + r],
      [x - r, y + r],
    ]),
  down: (ctx, x, y, r) =>
    polygon(ctx, [
      [x, y + r],
      [x + r, y - r],
      [x - r, y - r],
    ]),
  cross: (ctx, x, y, r) =>
    strokes(ctx, [
      [x - r, y - r, x + r, y + r],
      [x - r, y + r, x + r, y - r],
    ]),
  plus: (ctx, x, y, r) =>
    strokes(ctx, [
      [x - r, y, x + r, y],
      [x, y - r, x, y + r],
    ]),
};

/** @param {CanvasRenderingContext2D} ctx @param {number[][]} corners */
function polygon(ctx, corners) {
  for (const [i, [x, y]] of corners.entries()) i ? ctx.lineTo(x, y) : ctx.moveTo(x, y);
  ctx.closePath();
}

/** @param {CanvasRenderingContext2D} ctx @param {number[][]} parts */
function strokes(ctx, parts) {
  for (const [x0, y0, x1, y1] of parts) {
    ctx.moveTo(x0, y0);
    ctx.lineTo(x1, y1);
  }
}

/**
 * Ends of the bar of one point: of magnitude in dB or of phase in degrees.
 *
 * @param {boolean} phase
 * @param {number} value
 * @param {number} reach
 * @returns {[low: number, high: number]}
 */
const ends = (phase, value, reach) =>
  phase ? [value - halfDeg(reach), value + halfDeg(reach)] : [lowDb(value, reach), highDb(value, reach)];

/**
 * @param {Chart} u
 * @param {Curves} name
 * @param {Curve} curve
 * @param {Values} values drawn values over the grid
 * @param {"db" | "deg" | "coherence"} what
 * @param {boolean} parted whether the bound of the measured curve is drawn in parts
 */
export function drawPoints(u, name, curve, values, what, parted) {
  const { ctx, bbox } = u,
    px = devicePixelRatio * letters(),
    own = name === "measured" || name === "result";
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  ctx.setLineDash([]);
  ctx.strokeStyle = ctx.fillStyle = ink(name);
  /** @param {number} x @param {[number, number]} ends @param {number} width @param {number} cap */
  const bar = (x, [low, high], width, cap) => {
    if (!Number.isFinite(high - low)) return;
    const [top, bottom] = [u.valToPos(high, "y", true), u.valToPos(Math.max(low, -900), "y", true)];
    /** @param {number} wide @param {number[][]} parts */
    const stroke = (wide, parts) => {
      ctx.lineWidth = wide * px;
      ctx.beginPath();
      strokes(ctx, parts);
      ctx.stroke();
    };
    stroke(width, [[x, top, x, bottom]]);
    if (cap)
      stroke(
        1,
        [top, bottom].map((y) => [x - cap, y, x + cap, y]),
      );
  };
  for (const [i, at] of curve.index.entries()) {
    const value = values[at];
    if (typeof value !== "number" || !Number.isFinite(value)) continue;
    const x = u.valToPos(curve.hz[i], "x", true);
    if (what !== "coherence") {
      const phase = what === "deg";
      if (parted && name === "measured")
        for (const [outer, { ink: shade, width, reach }] of drawnAt(curve, i).entries()) {
          ctx.strokeStyle = colour(shade);
          bar(x, ends(phase, value, reach), width, outer === 0 ? CAP * px : 0);
        }
      else bar(x, ends(phase, value, curve.reach[i]), own ? 1.3 : 1, CAP * px);
      ctx.strokeStyle = ink(name);
    }
    ctx.lineWidth = 1.6 * px;
    ctx.beginPath();
    MARKERS[look(name).marker](ctx, x, u.valToPos(value, "y", true), RADIUS * px);
    if (own) ctx.fill();
    else ctx.stroke();
  }
  ctx.restore();
}

/**
 * The parts of the x axis over which a wrapped phase jumps, in pixels of the canvas.
 *
 * @param {Chart} u
 * @param {Values} deg
 * @returns {[number, number][]}
 */
export function jumps(u, deg) {
  /** @type {[number, number][]} */
  const found = [];
  let last = -1;
  for (const [i, value] of deg.entries()) {
    if (typeof value !== "number") continue;
    const before = last < 0 ? null : deg[last];
    if (typeof before === "number" && Math.abs(value - before) > 180)
      found.push([u.valToPos(u.data[0][last], "x", true), u.valToPos(u.data[0][i], "x", true)]);
    last = i;
  }
  return found;
}
