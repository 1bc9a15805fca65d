// @ts-check
// The curves in the planes of Nyquist and Nichols: the model, and points with their bounds; where there is no model they are
// joined in the order of frequency by straight lines.
import { letters } from "./chart.js";
import { nicholsBound } from "./contours.js";
import { ink, look } from "./looks.js";
import { label } from "./marks.js";
import { drawnAt } from "./parts.js";
import { drawingPicture } from "./picture.js";
import { across, circle, up } from "./planemarks.js";
import { MARKERS } from "./points.js";
import { colour } from "./theme.js";
import { frequency } from "./values.js";

/** @import { Traced } from "./plane.js" */
/** @import { Sheet } from "./planemarks.js" */

const EDGE = 48, // points of the edge of a bound
  NAMED = 8, // lines with their frequency
  APART_PX = 46;

/** @param {Sheet} sheet */
export function paintCurves(sheet) {
  const { plane } = sheet;
  for (const traced of plane.traced) {
    if (traced.name !== "model") bounds(sheet, traced);
    path(sheet, traced);
    if (traced.name !== "model") points(sheet, traced);
  }
  const own = plane.own();
  if (!own) return;
  named(sheet, own);
  placed(sheet, own);
}

/** @param {string} name */
const isOwn = (name) => name === "measured" || name === "result";

/** @param {Sheet} sheet @param {Traced} traced */
function bounds(sheet, { name, curve, x, y, db, deg }) {
  const { ctx, px, u, plane, bode } = sheet,
    faint = bode.few ? 1 : 0.35; // many bounds lie above each other
  ctx.setLineDash([]);
  ctx.lineWidth = px;
  const whole = (/** @type {number} */ i) => [{ ink: look(name).ink, reach: curve.reach[i] }],
    parted = bode.parted && name === "measured";
  for (const i of curve.hz.keys()) for (const part of parted ? drawnAt(curve, i) : whole(i)) bound(i, part);
  ctx.globalAlpha = 1;

  /** @param {number} i @param {{ink: string, reach: number}} part */
  function bound(i, { ink: shade, reach }) {
    if (!Number.isFinite(reach + x[i] + y[i])) return;
    ctx.strokeStyle = ctx.fillStyle = colour(shade);
    if (plane.round) circle(sheet, { re: x[i], im: y[i], radius: reach * 10 ** (db[i] / 20) });
    else {
      ctx.beginPath();
      for (const [k, [a, b]] of nicholsBound(deg[i], db[i], reach, EDGE).entries())
        k ? ctx.lineTo(across(u, a), up(u, b)) : ctx.moveTo(across(u, a), up(u, b));
    }
    ctx.globalAlpha = 0.14 * faint;
    if (isOwn(name) && (plane.round || reach < 1)) ctx.fill();
    ctx.globalAlpha = (isOwn(name) ? 0.6 : 0.4) * faint;
    ctx.stroke();
  }
}

/** @param {Sheet} sheet @param {Traced} traced */
function path({ ctx, px, u, bode }, { name, path, deg }) {
  if (!path) return;
  const model = name === "model",
    x = Array.from(path.x),
    { y } = path;
  ctx.strokeStyle = ink(name);
  // Thin: between the lines of a measurement nothing is known.
  ctx.lineWidth = (model ? 1.8 : 0.8) * px;
  ctx.setLineDash(look(name).dash.map((d) => d * px));
  ctx.beginPath();
  let open = false;
  for (const [i, v] of x.entries()) {
    const known = Number.isFinite(v + y[i]),
      jump = bode.view.wrapped && i > 0 && Math.abs(model ? x[i] - x[i - 1] : deg[i] - deg[i - 1]) > 180;
    if (known) open && !jump ? ctx.lineTo(across(u, v), up(u, y[i])) : ctx.moveTo(across(u, v), up(u, y[i]));
    open = known;
  }
  ctx.stroke();
  ctx.setLineDash([]);
}

/** @param {Sheet} sheet @param {Traced} traced */
function points({ ctx, px, u, bode }, { name, x, y }) {
  ctx.strokeStyle = ctx.fillStyle = ink(name);
  ctx.lineWidth = 1.6 * px;
  for (const [i, v] of x.entries()) {
    if (!Number.isFinite(v + y[i])) continue;
    ctx.beginPath();
    MARKERS[look(name).marker](ctx, across(u, v), up(u, y[i]), (bode.few ? 3.6 : 1.8) * px);
    if (isOwn(name)) ctx.fill();
    else ctx.stroke();
  }
}

/** The frequencies of a few lines, always of the same ones. @param {Sheet} sheet @param {Traced} traced */
function named(sheet, { curve, x, y }) {
  const { ctx, px, u, bode } = sheet,
    { bbox } = u,
    every = Math.max(1, Math.ceil(curve.hz.length / NAMED));
  ctx.font = `${11 * px}px system-ui, "DejaVu Sans", sans-serif`;
  /** @type {[number, number][]} */
  const before = [];
  for (let i = 0; i < curve.hz.length; i += every) {
    const [a, b] = [across(u, x[i]), up(u, y[i])];
    const inside = a > bbox.left && a < bbox.left + bbox.width && b > bbox.top && b < bbox.top + bbox.height;
    if (!inside || before.some(([c, d]) => Math.hypot(a - c, b - d) < APART_PX * px)) continue;
    before.push([a, b]);
    label(sheet, frequency(curve.hz[i], bode.view), a, b - 10 * px, "ink");
  }
}

/** The line under the cursor, and cursors A and B. @param {Sheet} sheet @param {Traced} traced */
function placed(sheet, { curve, x, y }) {
  const { ctx, px, u, bode } = sheet;
  ctx.strokeStyle = colour("ink");
  ctx.lineWidth = 2 * px;
  /** @param {number} i */
  const ring = (i) => {
    if (!Number.isFinite(x[i] + y[i])) return;
    ctx.beginPath();
    ctx.arc(across(u, x[i]), up(u, y[i]), 7 * px, 0, 7);
    ctx.stroke();
  };
  if (!drawingPicture() && letters() === 1) ring(bode.line);
  for (const [k, hz] of bode.cursors.hz.entries()) {
    const i = hz === null ? -1 : curve.hz.indexOf(hz);
    if (i < 0) continue;
    ring(i);
    label(sheet, "AB"[k], across(u, x[i]), up(u, y[i]) + 12 * px, "ink");
  }
}
