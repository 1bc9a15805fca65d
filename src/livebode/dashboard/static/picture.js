// @ts-check
// A plot as a picture of any size, light or dark: with title, legend and version, without cursor.
import { element } from "./make.js";
import { drawing, inTheme } from "./theme.js";

/** @typedef {{text: string, colour: string, dash: number[], sign: Path2D, filled: boolean}} Entry The sign is 26 by 12. */
/**
 * What is drawn: charts one below the other, or one canvas that draws itself.
 *
 * @typedef {object} Plot
 * @property {string} title
 * @property {string} words
 * @property {string} note
 * @property {() => Entry[]} legend
 * @property {import("./chart.js").Chart[]} [charts]
 * @property {(ctx: CanvasRenderingContext2D, width: number, height: number) => void} [draw]
 */
/** @typedef {{width: number, height: number, scale: number, theme: "light" | "dark"}} Paper in pixels; `scale` enlarges letters and lines */

const FONT = 'system-ui, "DejaVu Sans", sans-serif',
  MARGIN = 14;
let now = false;
/** Whether a picture is being drawn, without cursor and marks of the page. */
export const drawingPicture = () => now;

/**
 * The entries of a legend: the curves whose buttons are pressed, and keys.
 *
 * @param {HTMLElement} host
 * @returns {Entry[]}
 */
export function legendOf(host) {
  return Array.from(/** @type {NodeListOf<HTMLElement>} */ (host.querySelectorAll("button, .key")))
    .filter((entry) => !entry.hidden && entry.getAttribute("aria-pressed") !== "false" && entry.firstElementChild)
    .map((button) => {
      const drawn = button.querySelector("svg path"),
        swatch = drawn ?? button.querySelector(".swatch"),
        style = swatch ? getComputedStyle(swatch) : null,
        sign = new Path2D(drawn?.getAttribute("d") ?? "M0 6h26"),
        text = button.textContent?.trim() ?? "";
      if (drawn) {
        const dash = (drawn.getAttribute("stroke-dasharray") ?? "").split(" ").filter(Boolean).map(Number);
        return { text, colour: style?.stroke ?? "", dash, sign, filled: style?.fill !== "none" };
      }
      const dash = style?.borderTopStyle === "dashed" ? [6, 3] : style?.borderTopStyle === "dotted" ? [2, 2] : [];
      return { text, colour: style?.color ?? "", dash, sign, filled: false };
    });
}

/**
 * Text in lines that fit.
 *
 * @param {CanvasRenderingContext2D} ctx
 * @param {string} text
 * @param {number} room
 */
function wrapped(ctx, text, room) {
  const lines = [""];
  for (const word of text.split(" ")) {
    const longer = `${lines[lines.length - 1]} ${word}`.trim();
    if (ctx.measureText(longer).width <= room || !lines[lines.length - 1]) lines[lines.length - 1] = longer;
    else lines.push(word);
  }
  return lines;
}

/**
 * Title, words and legend; returns the height that they take.
 *
 * @param {CanvasRenderingContext2D} ctx
 * @param {Plot} plot
 * @param {number} width
 * @param {(name: string) => string} ink
 */
function head(ctx, plot, width, ink) {
  let y = MARGIN + 14;
  ctx.fillStyle = ink("ink");
  ctx.font = `600 16px ${FONT}`;
  for (const line of wrapped(ctx, plot.title, width - 2 * MARGIN)) {
    ctx.fillText(line, MARGIN, y);
    y += 20;
  }
  ctx.fillStyle = ink("muted");
  ctx.font = `12px ${FONT}`;
  for (const line of wrapped(ctx, plot.words, width - 2 * MARGIN)) {
    ctx.fillText(line, MARGIN, y);
    y += 17;
  }
  let x = MARGIN;
  y += 3;
  const entries = plot.legend();
  for (const { text, colour, dash, sign, filled } of entries) {
    const size = 32 + ctx.measureText(text).width + 16;
    if (x > MARGIN && x + size > width - MARGIN) {
      x = MARGIN;
      y += 17;
    }
    ctx.save();
    ctx.translate(x, y - 10);
    ctx.strokeStyle = ctx.fillStyle = colour;
    ctx.lineWidth = 2.4;
    ctx.setLineDash(dash);
    ctx.stroke(sign);
    if (filled) ctx.fill(sign);
    ctx.restore();
    ctx.fillStyle = ink("ink");
    ctx.fillText(text, x + 32, y);
    x += size;
  }
  return entries.length ? y + 8 : y - 8;
}

/**
 * Draw a chart in another size, copy it, and draw it as before; the screen shows nothing of it.
 *
 * @param {import("./chart.js").Chart} u
 * @param {{width: number, height: number}} size
 * @param {number} scale
 * @param {(canvas: HTMLCanvasElement) => void} copy
 */
function resized(u, size, scale, copy) {
  const before = { width: u.width, height: u.height },
    { canvas } = u.ctx;
  const enlarge = () => {
    canvas.width = Math.round(size.width * scale);
    canvas.height = Math.round(size.height * scale);
    u.ctx.scale(scale / devicePixelRatio, scale / devicePixelRatio);
  };
  const hooks = /** @type {{drawClear?: (() => void)[]}} */ (u.hooks);
  const own = hooks.drawClear;
  hooks.drawClear = [enlarge];
  u.batch(() => u.setSize(size));
  copy(canvas);
  hooks.drawClear = own ?? [];
  u.batch(() => u.setSize(before));
}

/**
 * @param {Plot} plot
 * @param {Paper} paper
 */
export function picture(plot, { width, height, scale, theme }) {
  const sheet = element("canvas");
  sheet.width = width;
  sheet.height = height;
  const ctx = drawing(sheet),
    [w, h] = [width / scale, height / scale];
  now = true;
  const again = inTheme(theme, (ink) => {
    ctx.scale(scale, scale);
    ctx.fillStyle = ink("paper");
    ctx.fillRect(0, 0, w, h);
    let top = head(ctx, plot, w, ink);
    ctx.fillStyle = ink("muted");
    ctx.font = `10px ${FONT}`;
    ctx.textAlign = "right";
    ctx.fillText(plot.note, w - MARGIN, h - 6);
    const room = h - top - 18;
    if (plot.draw) {
      ctx.translate(0, top);
      ctx.textAlign = "left";
      plot.draw(ctx, w, room);
    }
    const charts = plot.charts ?? [],
      sum = charts.reduce((total, u) => total + u.height, 0);
    for (const u of charts) {
      const size = { width: w, height: (room * u.height) / sum };
      resized(u, size, scale, (canvas) => ctx.drawImage(canvas, 0, top, size.width, size.height));
      top += size.height;
    }
    return charts;
  });
  now = false;
  for (const u of again) u.redraw(false, true); // in the colours of the page
  return sheet;
}
