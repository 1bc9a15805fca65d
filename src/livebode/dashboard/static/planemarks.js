// @ts-check
// What belongs to the open loop in the planes of Nyquist and Nichols: −1, circles and contours of the closed loop, margins.
import { circleS, circleT, nicholsT } from "./contours.js";
import { tr } from "./language.js";
import { baseOf, label, line, marksOf, NARROW, paintOf } from "./marks.js";
import { colour } from "./theme.js";
import { plain } from "./words.js";

/** @import { Bode } from "./bode.js" */
/** @import { Chart } from "./chart.js" */
/** @import { Circle } from "./contours.js" */
/** @import { Mark } from "./marks.js" */
/** @import { Plane } from "./plane.js" */
/**
 * @typedef {object} Sheet
 * @property {CanvasRenderingContext2D} ctx
 * @property {number} px
 * @property {Chart} u
 * @property {Plane} plane
 * @property {Bode} bode
 * @property {[x: number, y: number][]} taken places that have words
 */

const PHASE = 1;
/** Usual limits of the peak of the sensitivity, and the same of the closed loop. */
export const PEAKS = [1.4, 2];
/** Closed-loop magnitudes, dB. */
export const LEVELS_DB = [12, 6, 3, 1, 0, -1, -3, -6, -12, -20];
const POINTS = 361,
  ROOM_PX = 62,
  ROW_PX = 16,
  ROWS = 24, // of words that are tried for a place without a curve
  WORDS_PX = 14; // below the critical point
/** Contours of |T|, as in `nicholsT`; open ones from left to right. */
const CONTOURS = LEVELS_DB.map((level) => {
  const points = nicholsT(10 ** (level / 20), POINTS);
  return { level, points: level < 0 ? points.sort(([a], [b]) => a - b) : points };
});
const FONT = (/** @type {number} */ px) => `${11 * px}px system-ui, "DejaVu Sans", sans-serif`;
const BOLD = (/** @type {number} */ px) => `600 ${11.5 * px}px system-ui, "DejaVu Sans", sans-serif`;

/** @param {Chart} u @param {number} v */
export const across = (u, v) => u.valToPos(v, "x", true);
/** @param {Chart} u @param {number} v */
export const up = (u, v) => u.valToPos(v, "y", true);

/** @param {Sheet} sheet @param {Circle} circle */
export function circle({ ctx, u }, { re, im, radius }) {
  ctx.beginPath();
  ctx.ellipse(
    across(u, re),
    up(u, im),
    Math.abs(across(u, re + radius) - across(u, re)),
    Math.abs(up(u, im + radius) - up(u, im)),
    0,
    0,
    2 * Math.PI,
  );
}

/** Below the curves. @param {Sheet} sheet */
export function paintGround(sheet) {
  const { ctx, px, plane } = sheet;
  ctx.font = FONT(px);
  ctx.lineWidth = 1.1 * px;
  if (plane.round) circles(sheet);
  else contours(sheet);
}

/** @param {Sheet} sheet */
function circles(sheet) {
  const { ctx, px, u } = sheet;
  /** @type {[Circle, number[], string, number, string][]} words at an angle of the circle */
  const all = [[{ re: 0, im: 0, radius: 1 }, [9, 3], "|L| = 1", -45, "ink"]];
  for (const m of PEAKS) {
    all.push([circleS(m), [4, 3], `|S| = ${plain(m, 2)}`, -90, "muted"]);
    all.push([circleT(m), [1.5, 3], `|T| = ${plain(m, 2)}`, 90, "muted"]);
  }
  for (const [one, dash, words, at, paint] of all) {
    ctx.strokeStyle = colour(paint);
    ctx.setLineDash(dash.map((d) => d * px));
    circle(sheet, one);
    ctx.stroke();
    ctx.setLineDash([]);
    const turn = (at * Math.PI) / 180;
    const [x, y] = [across(u, one.re + one.radius * Math.cos(turn)), up(u, one.radius * Math.sin(turn))];
    unlessTaken(sheet, words, x, y, paint);
  }
  const zero = up(u, 0);
  ctx.strokeStyle = colour("edge");
  line(ctx, u.bbox.left, zero, u.bbox.left + u.bbox.width, zero);
  line(ctx, across(u, 0), u.bbox.top, across(u, 0), u.bbox.top + u.bbox.height);
}

/** @param {Sheet} sheet */
function contours(sheet) {
  const { ctx, px, u } = sheet,
    { min = -360, max = 0 } = u.scales.x;
  for (let turn = Math.floor(min / 360); turn <= Math.floor(max / 360); turn++) {
    const shift = 360 * (turn + 1);
    for (const one of CONTOURS) contour(sheet, one, shift);
  }
  ctx.strokeStyle = colour("edge");
  ctx.lineWidth = 1.2 * px;
  line(ctx, u.bbox.left, up(u, 0), u.bbox.left + u.bbox.width, up(u, 0));
}

/** @param {Sheet} sheet @param {typeof CONTOURS[number]} one @param {number} shift ° */
function contour(sheet, { level, points }, shift) {
  const { ctx, px, u } = sheet;
  ctx.strokeStyle = colour("muted");
  ctx.globalAlpha = level === 3 || level === 0 || level === -3 ? 0.9 : 0.5;
  ctx.lineWidth = px;
  ctx.setLineDash([1.5 * px, 3 * px]);
  ctx.beginPath();
  for (const [i, [deg, db]] of points.entries())
    i ? ctx.lineTo(across(u, deg + shift), up(u, db)) : ctx.moveTo(across(u, deg + shift), up(u, db));
  if (level > 0) ctx.closePath();
  ctx.stroke();
  ctx.setLineDash([]);
  ctx.globalAlpha = 1;
  const words = `${level > 0 ? "+" : level < 0 ? "−" : ""}${Math.abs(level)} dB`;
  // At the lowest point of a closed contour, at the right end of an open one, where they are apart.
  const seen = points.map(([deg, db]) => [across(u, deg + shift), up(u, db)]).filter(([x, y]) => inside(u, x, y));
  if (!seen.length) return;
  const [x, y] = seen.reduce((a, b) => ((level > 0 ? b[1] > a[1] : b[0] > a[0]) ? b : a));
  unlessTaken(sheet, words, x, y, "muted");
}

/** Words of the ground, unless others are there. @param {Sheet} sheet @param {string} words @param {number} x @param {number} y @param {string} paint */
function unlessTaken(sheet, words, x, y, paint) {
  const { u, px, taken } = sheet;
  if (!inside(u, x, y) || taken.some(([a, b]) => Math.abs(a - x) < ROOM_PX * px && Math.abs(b - y) < ROW_PX * px))
    return;
  taken.push([x, y]);
  label(sheet, words, x, y, paint);
}

/** @param {Chart} u @param {number} x @param {number} y */
const inside = ({ bbox }, x, y) =>
  x >= bbox.left && x <= bbox.left + bbox.width && y >= bbox.top && y <= bbox.top + bbox.height;

/** A cross where the closed loop has no bound. @param {Sheet} sheet @param {number} x @param {number} y @param {string} words */
function critical(sheet, x, y, words) {
  const { ctx, px, u } = sheet,
    r = 6 * px;
  ctx.strokeStyle = colour("ink");
  ctx.lineWidth = 2.4 * px;
  line(ctx, x - r, y, x + r, y);
  line(ctx, x, y - r, x, y + r);
  ctx.font = BOLD(px);
  if (inside(u, x, y)) label(sheet, words, x, y + WORDS_PX * px, "ink");
}

/** Above the curves: the margins of the fitted model. @param {Sheet} sheet */
export function paintLoop(sheet) {
  const { ctx, px, plane, bode } = sheet;
  ctx.font = BOLD(px);
  ctx.setLineDash([]);
  sheet.taken = [[across(sheet.u, plane.round ? -1 : -180), up(sheet.u, 0) + WORDS_PX * px]];
  for (const mark of marksOf(bode)) {
    ctx.strokeStyle = ctx.fillStyle = colour(paintOf(mark));
    ctx.lineWidth = 2.4 * px;
    if (plane.round) onNyquist(sheet, mark);
    else onNichols(sheet, mark);
  }
  crosses(sheet);
}

/** −1, or 0 dB at every odd multiple of 180°. @param {Sheet} sheet */
function crosses(sheet) {
  const { u, plane } = sheet;
  if (plane.round) {
    critical(sheet, across(u, -1), up(u, 0), "−1");
    return;
  }
  const { min = -360, max = 0 } = u.scales.x;
  for (let deg = 360 * Math.ceil((min - 180) / 360) + 180; deg <= max; deg += 360)
    critical(sheet, across(u, deg), up(u, 0), `0 dB, ${deg < 0 ? "−" : ""}${Math.abs(deg)}°`);
}

/**
 * Where the loop crosses: on the negative real axis, or on the unit circle.
 *
 * @param {Mark} mark
 * @returns {[re: number, im: number]}
 */
export function crossing({ chart, level }) {
  if (chart === 0) return [-(10 ** (level / 20)), 0];
  const turn = ((level - 180) * Math.PI) / 180;
  return [Math.cos(turn), Math.sin(turn)];
}

/** @param {Sheet} sheet @param {Mark} mark */
function onNyquist(sheet, mark) {
  const { ctx, u } = sheet,
    [re, im] = crossing(mark),
    [x, y] = [across(u, re), up(u, im)];
  if (mark.chart === 0) line(ctx, x, y, across(u, -1), up(u, 0));
  else {
    ctx.beginPath();
    for (let i = 0; i <= 40; i++) {
      const turn = (((mark.level * i) / 40 - 180) * Math.PI) / 180,
        [ax, ay] = [across(u, Math.cos(turn)), up(u, Math.sin(turn))];
      i ? ctx.lineTo(ax, ay) : ctx.moveTo(ax, ay);
    }
    ctx.stroke();
  }
  ringed(sheet, x, y, mark, mark.chart === 0 ? -14 : 14);
}

/** @param {Sheet} sheet @param {Mark} mark */
function onNichols(sheet, mark) {
  const { ctx, u, bode } = sheet,
    base = baseOf(bode, PHASE, mark),
    [deg, db] = mark.chart === 0 ? [base, mark.level] : [base + mark.level, 0],
    [x, y] = [across(u, deg), up(u, db)];
  line(ctx, x, y, across(u, base), up(u, 0));
  ringed(sheet, x, y, mark, -14);
}

/** @param {Sheet} sheet @param {number} x @param {number} y @param {Mark} mark @param {number} below */
function ringed(sheet, x, y, mark, below) {
  const { words, hz } = mark,
    { ctx, px, u, taken } = sheet,
    { left, top, width, height } = u.bbox;
  ctx.lineWidth = 1.8 * px;
  ctx.beginPath();
  ctx.arc(x, y, 5.5 * px, 0, 7);
  ctx.stroke();
  // One that is not visible is named at the edge beside which it is.
  const text = inside(u, x, y) ? words : tr("{margin} at {hz} Hz", { margin: words, hz: plain(hz, 3) });
  if (width < NARROW * px) return; // the words are below the plot
  const wide = ctx.measureText(text).width + 8 * px,
    tall = 15 * px,
    first = Math.min(top + height - ROW_PX * px, Math.max(top + tall / 2, y + below * px));
  for (let i = 0; i < ROWS; i++) {
    const row = first + (i % 2 ? 1 : -1) * Math.ceil(i / 2) * ROW_PX * px;
    for (const at of [x + 6 * px, x - wide - 6 * px]) {
      const start = Math.min(left + width - wide, Math.max(left, at)),
        box = { left: start, top: row - tall / 2, right: start + wide, bottom: row + tall / 2 };
      if (box.top < top || box.bottom > top + height || covered(sheet, box)) continue;
      if (taken.some(([a, b]) => a > box.left - wide && a < box.right && Math.abs(b - row) < ROW_PX * 0.9 * px))
        continue;
      taken.push([start, row]);
      label(sheet, text, start - 6 * px, row, paintOf(mark));
      return;
    }
  }
}

/** Whether a curve is in a box. @param {Sheet} sheet @param {import("./marks.js").Box} box */
function covered({ u, plane }, box) {
  return plane.traced.some(({ x, y, path }) =>
    [{ x, y }, ...(path ? [path] : [])].some((all) =>
      Array.from(all.x).some((v, i) => {
        const [a, b] = [across(u, v), up(u, all.y[i])];
        return a > box.left && a < box.right && b > box.top && b < box.bottom;
      }),
    ),
  );
}
