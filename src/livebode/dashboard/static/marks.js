// @ts-check
// What is drawn above the curves: 0 dB and −180° of the open loop with its margins, cursors, peaks, annotations.
import { letters } from "./chart.js";
import { tr } from "./language.js";
import { look } from "./looks.js";
import { drawingPicture } from "./picture.js";
import { colour } from "./theme.js";
import { plain } from "./words.js";

/** @import { Bode } from "./bode.js" */
/** @import { Chart } from "./chart.js" */
/**
 * A margin: at `hz` the curve of `chart` (0 magnitude in dB, 1 phase in degrees) differs by `level` from 0 dB or −180°.
 *
 * `of` the curve if it is not the fitted model.
 *
 * @typedef {{name: string, chart: 0 | 1, hz: number, level: number, value: number, words: string, of?: "what if"}} Mark
 */
/** `taken`: places that have words. @typedef {{ctx: CanvasRenderingContext2D, px: number, u: Chart, index: number, bode: Bode, taken: Box[]}} Sheet */
/** In pixels of the canvas. @typedef {{left: number, top: number, right: number, bottom: number}} Box */

const MAGNITUDE = 0,
  PHASE = 1;
const FONT = (/** @type {number} */ px) => `600 ${11.5 * px}px system-ui, "DejaVu Sans", sans-serif`;

/**
 * @param {Bode} bode
 * @param {Chart} u
 * @param {number} index
 */
export function drawMarks(bode, u, index) {
  const { ctx, bbox } = u,
    px = devicePixelRatio,
    /** @type {Sheet} */
    sheet = { ctx, px, u, index, bode, taken: [] };
  ctx.save();
  ctx.beginPath();
  ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
  ctx.clip();
  ctx.setLineDash([]);
  ctx.font = FONT(px);
  if (ofLoop(bode)) drawLoop(sheet);
  drawAnnotations(sheet);
  if (!drawingPicture() && letters() === 1) drawCursor(sheet); // nobody moves a cursor on a wall
  drawFixed(sheet);
  drawExtremum(sheet);
  ctx.restore();
}

/**
 * What of the margins belongs into the visible range of a chart.
 *
 * @param {Bode} bode
 * @param {0 | 1} index
 * @returns {number[]}
 */
export function marked(bode, index) {
  if (!ofLoop(bode)) return [];
  const ends = marksOf(bode).flatMap((mark) => {
    if (mark.hz < bode.sight[0] || mark.hz > bode.sight[1]) return [];
    const base = baseOf(bode, index, mark);
    return mark.chart === index ? [base, base + mark.level] : [base];
  });
  return index === MAGNITUDE ? [0, ...ends] : ends;
}

/** Whether crossings of 0 dB and −180° are those of the loop. @param {Bode} bode */
export const ofLoop = (bode) => bode.quantity === "open loop" && bode.view.plain && !bode.operation;

/** @param {Sheet} sheet @param {number} f */
const inSight = ({ bode }, f) => f >= bode.sight[0] && f <= bode.sight[1];

/** @param {Sheet} sheet @param {number} value @param {string} text */
function horizontal({ ctx, px, u }, value, text) {
  const y = u.valToPos(value, "y", true);
  ctx.strokeStyle = ctx.fillStyle = colour("ink");
  ctx.lineWidth = 1.2 * px;
  ctx.setLineDash([9 * px, 3 * px]);
  line(ctx, u.bbox.left, y, u.bbox.left + u.bbox.width, y);
  ctx.setLineDash([]);
  ctx.textAlign = "right";
  ctx.textBaseline = "alphabetic";
  ctx.fillText(text, u.bbox.left + u.bbox.width - 4 * px, y - 4 * px);
}

/** @param {Sheet} sheet @param {number} f @param {number[]} dash @param {string} paint @param {number} width */
function vertical({ ctx, px, u }, f, dash, paint, width) {
  const x = u.valToPos(f, "x", true);
  ctx.strokeStyle = colour(paint);
  ctx.lineWidth = width * px;
  ctx.setLineDash(dash);
  line(ctx, x, u.bbox.top, x, u.bbox.top + u.bbox.height);
  ctx.setLineDash([]);
  return x;
}

/** @param {CanvasRenderingContext2D} ctx @param {number} x0 @param {number} y0 @param {number} x1 @param {number} y1 */
export function line(ctx, x0, y0, x1, y1) {
  ctx.beginPath();
  ctx.moveTo(x0, y0);
  ctx.lineTo(x1, y1);
  ctx.stroke();
}

/** Text beside a place, on the side that has room, on paper so that it can be read above curves. @param {Pick<Sheet, "ctx" | "px" | "u">} sheet @param {string} text @param {number} x @param {number} y @param {string} paint */
export function label({ ctx, px, u }, text, x, y, paint) {
  const width = ctx.measureText(text).width + 8 * px,
    height = 15 * px,
    { left, top, width: room, height: tall } = u.bbox;
  const at = x + width + 6 * px > left + room ? Math.max(left, x - width - 6 * px) : x + 6 * px,
    middle = Math.min(top + tall - height, Math.max(top, y - height / 2));
  ctx.globalAlpha = 0.85;
  ctx.fillStyle = colour("paper");
  ctx.fillRect(at, middle, width, height);
  ctx.globalAlpha = 1;
  ctx.fillStyle = colour(paint);
  ctx.textAlign = "left";
  ctx.fillText(text, at + 4 * px, middle + 11.2 * px);
}

const ROW_PX = 17,
  CLEAR_PX = 4; // between words and a curve

/** Words beside a mark where neither a curve nor other words are; none where there is no such place. @param {Sheet} sheet @param {string} text @param {number} x @param {number} y @param {string} paint */
function labelClear(sheet, text, x, y, paint) {
  const { ctx, px, u, taken } = sheet,
    { left, top, width: room, height: tall } = u.bbox,
    width = ctx.measureText(text).width + 8 * px,
    height = 15 * px;
  const rows = Array.from(
    { length: Math.floor(tall / (ROW_PX * px)) * 2 },
    (_, i) => (i % 2 ? 1 : -1) * Math.ceil(i / 2),
  );
  const sides = [x + 6 * px, x - width - 6 * px].filter((at) => at >= left && at + width <= left + room);
  for (const row of rows)
    for (const at of sides) {
      const above = y - height / 2 + row * ROW_PX * px;
      if (above < top || above + height > top + tall) continue;
      const box = { left: at, top: above, right: at + width, bottom: above + height };
      if (taken.some((other) => meet(box, other)) || covered(sheet, box)) continue;
      taken.push(box);
      label(sheet, text, at - 6 * px, above + height / 2, paint);
      return;
    }
}

/** @param {Box} a @param {Box} b */
const meet = (a, b) => a.left < b.right && a.right > b.left && a.top < b.bottom && a.bottom > b.top;

/** Whether a curve or its bounds are in a box. @param {Sheet} sheet @param {Box} box */
function covered({ u, bode, index, px }, box) {
  const clear = CLEAR_PX * px;
  return bode.laid.some((name) => {
    const first = bode.seriesOf(index, name);
    if (first < 1 || !bode.shown.has(name)) return false;
    const own = name === "model" ? [first] : [first, first + 1, first + 2].filter((i) => i < u.data.length);
    let before = NaN; // a line comes from there
    return Array.from(u.data[0]).some((hz, i) => {
      const ys = own.flatMap((k) => {
        const v = u.data[k][i];
        return typeof v === "number" && Number.isFinite(v) ? [u.valToPos(v, "y", true)] : [];
      });
      if (!ys.length) return false;
      const x = u.valToPos(hz, "x", true);
      const reach = [...ys, ...(Number.isFinite(before) ? [before] : [])];
      before = name === "measured" && bode.few ? NaN : ys[0];
      if (x < box.left - clear || x > box.right + clear) return false;
      return Math.min(...reach) < box.bottom + clear && Math.max(...reach) > box.top - clear;
    });
  });
}

/** The margins in words, with their frequencies; empty where there are none. @param {Bode} bode */
export const marginWords = (bode) =>
  ofLoop(bode)
    ? marksOf(bode)
        .map(({ words, hz, chart, of }) => {
          const name = chart ? tr("phase margin") : tr("gain margin");
          const margin = of ? `${name} ${words}` : words;
          return tr("{margin} at {hz} Hz", { margin, hz: plain(hz, 3) });
        })
        .join(" · ")
    : "";

/** Margins of the fitted model, and those of the derived curve; alone where both would hide the curves. @param {Bode} bode */
export function marksOf({ derived, known }) {
  const marks = derived?.marks() ?? [];
  return derived?.alone && marks.length ? marks : [...known.margins(), ...marks];
}

/** @param {Mark} mark */
export const paintOf = ({ of }) => look(of ?? "model").ink;

export const NARROW = 420; // width of a plot, in pixels of the page

/** @param {Sheet} sheet */
function drawLoop(sheet) {
  const { u, bode, index, ctx, px } = sheet,
    { min = 0, max = 0 } = u.scales.y;
  if (index === MAGNITUDE) horizontal(sheet, 0, "0 dB");
  if (index === PHASE)
    for (let deg = 360 * Math.ceil((min - 180) / 360) + 180; deg <= max; deg += 360)
      horizontal(sheet, deg, `${deg < 0 ? "−" : ""}${Math.abs(deg)}°`);
  const wordless = u.bbox.width < NARROW * px; // they are below the plot, too
  for (const mark of marksOf(bode)) {
    if (!inSight(sheet, mark.hz)) {
      if (mark.chart === index && !wordless) beyond(sheet, mark);
      continue;
    }
    const base = baseOf(bode, index, mark),
      x = u.valToPos(mark.hz, "x", true);
    ctx.strokeStyle = ctx.fillStyle = colour(paintOf(mark));
    ctx.lineWidth = 2.4 * px;
    if (mark.chart === index) {
      const [y0, y1] = [u.valToPos(base, "y", true), u.valToPos(base + mark.level, "y", true)];
      line(ctx, x, y0, x, y1);
      for (const y of [y0, y1]) line(ctx, x - 4 * px, y, x + 4 * px, y);
      if (!wordless) labelClear(sheet, mark.words, x, (y0 + y1) / 2, paintOf(mark));
    } else if (index !== 2 && mark.name !== "delay_margin") {
      // The crossover, where the other curve passes 0 dB or −180°.
      ctx.lineWidth = 1.8 * px;
      ctx.beginPath();
      ctx.arc(x, u.valToPos(base, "y", true), 5.5 * px, 0, 7);
      ctx.stroke();
    }
  }
}

/** A margin at a frequency that is not visible, at the edge beside which it is. @param {Sheet} sheet @param {Mark} mark */
function beyond(sheet, mark) {
  const { u, bode, px } = sheet,
    left = mark.hz < bode.sight[0],
    text = tr("{margin} at {hz} Hz", { margin: mark.words, hz: plain(mark.hz, 3) });
  const x = left ? u.bbox.left : u.bbox.left + u.bbox.width;
  labelClear(sheet, left ? `◂ ${text}` : `${text} ▸`, x, u.bbox.top + u.bbox.height - 10 * px, paintOf(mark));
}

/**
 * 0 dB, or the odd multiple of 180° that the drawn phase belongs to.
 *
 * @param {Bode} bode
 * @param {number} index
 * @param {Mark} mark
 */
export function baseOf(bode, index, mark) {
  if (index !== PHASE) return 0;
  const name = mark.of ?? (bode.drawn.model && bode.shown.has("model") ? "model" : "measured"),
    [curve, drawn] = [bode.curves[name], bode.drawn[name]];
  if (!curve || !drawn) return -180;
  const near = curve.hz.reduce(
    (best, f, i) => (Math.abs(f - mark.hz) < Math.abs(curve.hz[best] - mark.hz) ? i : best),
    0,
  );
  const deg = (drawn.deg[curve.index[near]] ?? -180) + drawn.turns,
    expected = mark.chart === PHASE ? mark.level : 0;
  return -180 + 360 * Math.round((deg - expected + 180) / 360);
}

/** The line under the cursor, with a ring around the measured value. @param {Sheet} sheet */
function drawCursor(sheet) {
  const { u, bode, ctx, px, index } = sheet,
    f = bode.lines[bode.line];
  if (!inSight(sheet, f)) return;
  const x = vertical(sheet, f, [3, 4], "muted", 1);
  const name = bode.main,
    series = bode.charts[index] === u ? bode.seriesOf(index, name) : -1;
  const value = series > 0 ? u.data[series][bode.at[bode.line]] : null;
  if (typeof value !== "number" || !bode.shown.has(name)) return;
  ctx.lineWidth = 2 * px;
  ctx.strokeStyle = colour("ink");
  ctx.beginPath();
  ctx.arc(x, u.valToPos(value, "y", true), 6.5 * px, 0, 7);
  ctx.stroke();
}

/** Cursors A and B. @param {Sheet} sheet */
function drawFixed(sheet) {
  const { u, bode, ctx, px, index } = sheet;
  for (const [i, f] of bode.cursors.hz.entries()) {
    if (f === null || !inSight(sheet, f)) continue;
    const x = vertical(sheet, f, [], "ink", 1.4);
    if (index !== MAGNITUDE) continue;
    ctx.fillStyle = colour("ink");
    ctx.fillRect(x - 8 * px, u.bbox.top, 16 * px, 16 * px);
    ctx.fillStyle = colour("paper");
    ctx.textAlign = "center";
    ctx.fillText("AB"[i], x, u.bbox.top + 12 * px);
  }
}

/** @param {Sheet} sheet */
function drawExtremum(sheet) {
  const { u, bode, ctx, px, index } = sheet,
    found = bode.extremum;
  if (!found || index !== MAGNITUDE || !inSight(sheet, found.hz)) return;
  const [x, y] = [u.valToPos(found.hz, "x", true), u.valToPos(found.db, "y", true)],
    side = found.peak ? -1 : 1;
  ctx.fillStyle = colour("ink");
  ctx.beginPath();
  ctx.moveTo(x, y + 3 * side * px);
  ctx.lineTo(x - 6 * px, y + 13 * side * px);
  ctx.lineTo(x + 6 * px, y + 13 * side * px);
  ctx.fill();
  label(sheet, found.peak ? tr("peak") : tr("antiresonance"), x, y + 10 * side * px, "ink");
}

/** @param {Sheet} sheet */
function drawAnnotations(sheet) {
  const { u, bode, index, px } = sheet;
  let row = 0;
  for (const { frequency_hz: f, text } of bode.annotations) {
    if (!inSight(sheet, f)) continue;
    const x = vertical(sheet, f, [1, 3], "muted", 1.2);
    // One below the other, so that neighbours can be read.
    if (index === MAGNITUDE) label(sheet, text, x, u.bbox.top + (26 + 16 * (row++ % 4)) * px, "ink");
  }
}
