// @ts-check
// Position × frequency, or time × frequency as a waterfall: the level, its change from the median of the place, or the
// coherence.
import { moment } from "./clock.js";
import { tr } from "./language.js";
import { sorted } from "./map-cells.js";
import { between } from "./rows.js";
import { colour, drawing, onTheme } from "./theme.js";
import { timeLabel, timeMarks, timeSplits } from "./time-ticks.js";
import { fixed, hertz, label, mark, plain, signed } from "./words.js";

/** @import { Cells, Shown } from "./map-cells.js" */
/** @import { History, Named } from "./messages.js" */
/** @import { View } from "./view.js" */
/** @typedef {[red: number, green: number, blue: number]} Colour */

/**
 * @typedef {object} Scales
 * @property {Cells} cells
 * @property {number} low
 * @property {number} high
 * @property {Colour[]} stops
 * @property {(log: number) => number} yOf
 * @property {boolean} change
 */

/** @type {Record<Shown, string>} */
const WORDS = {
  level: tr("map of the level"),
  change: tr("map of the change"),
  coherence: tr("map of the coherence"),
};
/**
 * Cividis (Nuñez, Anderton, Renslow 2018), which looks the same with any colour vision.
 *
 * @type {Colour[]}
 */
const LEVELS = [
  [0, 32, 76],
  [0, 48, 111],
  [57, 71, 108],
  [87, 93, 109],
  [112, 115, 115],
  [138, 138, 121],
  [166, 161, 118],
  [196, 186, 107],
  [228, 213, 86],
  [255, 234, 70],
];
/**
 * Blue to orange for a change.
 *
 * @type {Record<string, Colour[]>}
 */
const CHANGES = {
  light: [
    [0, 84, 150],
    [120, 178, 222],
    [250, 250, 250],
    [240, 170, 110],
    [168, 72, 0],
  ],
  dark: [
    [120, 196, 255],
    [40, 96, 146],
    [22, 28, 35],
    [148, 84, 30],
    [255, 176, 90],
  ],
};

/**
 * @param {Colour[]} stops
 * @param {number} share
 */
function shade(stops, share) {
  const x = Math.min(1, Math.max(0, share)) * (stops.length - 1),
    i = Math.min(stops.length - 2, Math.floor(x)),
    t = x - i;
  return `rgb(${stops[i].map((c, k) => Math.round(c + t * (stops[i + 1][k] - c))).join(",")})`;
}

export class LineMap {
  /**
   * @param {HTMLCanvasElement} canvas
   * @param {HTMLElement} hover
   * @param {View} view units of the Bode plot
   */
  constructor(canvas, hover, view) {
    this.canvas = canvas;
    this.hover = hover;
    this.view = view;
    /** @type {Shown} */
    this.what = "level";
    /** @type {"position" | "time"} */
    this.over = "position";
    this.begun = false;
    /** @type {number[]} */
    this.lines = [];
    /** @type {Named} */
    this.schedule = { name: "", unit: "" };
    /** @type {Cells | null} */
    this.cells = null;
    canvas.addEventListener("pointermove", (event) => this.point(event));
    canvas.addEventListener("pointerdown", (event) => this.point(event));
    canvas.addEventListener("pointerleave", () => {
      hover.textContent = "";
    });
    new ResizeObserver(() => this.paint()).observe(canvas);
    onTheme(() => this.paint());
  }

  /**
   * @param {{frequency_hz: number[]}} facts
   * @param {Named} schedule
   */
  begin(facts, schedule) {
    this.begun = true;
    this.lines = facts.frequency_hz;
    this.schedule = schedule;
    this.cells = null;
    this.paint();
  }

  // Show nothing until the next `begin`.
  clear() {
    this.begin({ frequency_hz: [] }, this.schedule);
    this.hover.textContent = "";
  }

  /**
   * Sort the rows into cells.
   *
   * @param {History} rows
   * @param {number} fromS
   * @param {number} toS
   */
  draw(rows, fromS, toS) {
    this.cells = sorted(rows, between(rows, fromS, toS), this.lines.length, this.over);
    this.paint();
  }

  // Of what is shown: columns of values of the lines.
  get values() {
    const values = this.cells?.of(this.what) ?? [],
      { aboveDb } = this.view;
    return this.what === "level" && aboveDb ? values.map((column) => column.map((v) => v + aboveDb)) : values;
  }

  box({ w, h } = { w: this.canvas.clientWidth, h: this.canvas.clientHeight }) {
    return { w, h, left: 48, top: 8, right: w - 78, bottom: h - 38 };
  }

  edges() {
    const log = this.lines.map(Math.log),
      inner = log.slice(1).map((v, i) => (v + log[i]) / 2);
    if (log.length === 1) return [log[0] - 0.1, log[0] + 0.1];
    return [2 * log[0] - inner[0], ...inner, 2 * log[log.length - 1] - inner[inner.length - 1]];
  }

  paint() {
    const { canvas } = this,
      { clientWidth: w, clientHeight: h } = canvas;
    if (w < 10 || h < 10 || !this.begun) return;
    const ratio = devicePixelRatio,
      ctx = drawing(canvas);
    canvas.width = Math.round(w * ratio);
    canvas.height = Math.round(h * ratio);
    ctx.scale(ratio, ratio);
    this.drawOn(ctx, w, h);
  }

  /**
   * @param {CanvasRenderingContext2D} ctx
   * @param {number} w
   * @param {number} h
   */
  drawOn(ctx, w, h) {
    const { cells } = this,
      box = this.box({ w, h }),
      { left, top, right, bottom } = box;
    ctx.font = '12px system-ui, "DejaVu Sans", sans-serif';
    ctx.fillStyle = colour("muted");
    if (!cells) {
      ctx.fillText(tr("no valid response"), left, top + 20);
      return;
    }
    const { values } = this,
      flat = values.flat().filter(Number.isFinite);
    const change = this.what === "change",
      edges = this.edges();
    const sizes = flat.map(Math.abs).sort((a, b) => a - b),
      reach = Math.max(0.1, sizes[Math.floor(0.99 * (sizes.length - 1))] || 0);
    const [low, high] = change
      ? [-reach, reach]
      : this.what === "coherence"
        ? [0, 1]
        : [Math.min(...flat), Math.max(...flat, Math.min(...flat) + 0.1)];
    const stops = change ? CHANGES[document.documentElement.dataset.theme ?? "light"] || CHANGES.light : LEVELS;
    /** @param {number} log */
    const yOf = (log) => bottom - ((log - edges[0]) / (edges[edges.length - 1] - edges[0])) * (bottom - top);
    const width = (right - left) / cells.columns;
    ctx.fillStyle = colour("nothing");
    ctx.fillRect(left, top, right - left, bottom - top);
    for (const [i, column] of values.entries())
      for (const [k, v] of column.entries()) {
        if (!Number.isFinite(v)) continue;
        ctx.fillStyle = shade(stops, (v - low) / (high - low));
        const y = yOf(edges[k + 1]);
        ctx.fillRect(left + i * width, y, width + 0.6, yOf(edges[k]) - y + 0.6);
      }
    this.scales(ctx, { cells, low, high, stops, yOf, change }, box);
  }

  /**
   * @param {CanvasRenderingContext2D} ctx
   * @param {Scales} drawn
   * @param {ReturnType<LineMap["box"]>} box
   */
  scales(ctx, { cells, low, high, stops, yOf, change }, { left, top, right, bottom, h }) {
    ctx.fillStyle = colour("muted");
    ctx.textAlign = "right";
    ctx.textBaseline = "middle";
    let before = Infinity;
    for (const f of this.lines) {
      const y = yOf(Math.log(f));
      if (before - y >= 16) {
        ctx.fillText(hertz(f), left - 6, y);
        before = y;
      }
    }
    ctx.save();
    ctx.translate(11, (top + bottom) / 2);
    ctx.rotate(-Math.PI / 2);
    ctx.textAlign = "center";
    ctx.fillText(tr("frequency in Hz"), 0, 0);
    ctx.restore();
    ctx.textAlign = "center";
    ctx.textBaseline = "top";
    const reach = cells.step * cells.columns,
      end = cells.low + reach;
    const values = cells.moving ? fifths(cells.low, reach) : timeSplits(cells.low, end, right - left);
    (cells.moving ? values.map(mark) : timeMarks(values)).forEach((text, i) => {
      ctx.fillText(text, left + ((right - left) * (values[i] - cells.low)) / reach, bottom + 4);
    });
    ctx.fillText(cells.moving ? label(this.schedule) : timeLabel(cells.low, end), (left + right) / 2, h - 15);
    for (let i = 0; i < 60; i++) {
      ctx.fillStyle = shade(stops, i / 59);
      ctx.fillRect(right + 10, bottom - ((i + 1) * (bottom - top)) / 60, 12, (bottom - top) / 60 + 0.6);
    }
    ctx.fillStyle = colour("muted");
    ctx.textAlign = "left";
    ctx.textBaseline = "middle";
    for (const share of [0, 0.5, 1]) {
      const value = low + share * (high - low);
      ctx.fillText(
        change ? signed(value, reachDigits(high)) : mark(Number(value.toFixed(high - low < 3 ? 1 : 0))),
        right + 26,
        bottom - share * (bottom - top),
      );
    }
    ctx.textAlign = "center";
    ctx.textBaseline = "top";
    ctx.fillText(this.unit, right + 16, h - 15);
  }

  /** @param {PointerEvent} event */
  point(event) {
    const { left, top, right, bottom } = this.box(),
      { cells } = this,
      x = event.offsetX,
      y = event.offsetY;
    if (!cells || x < left || x >= right || y < top || y >= bottom) {
      this.hover.textContent = "";
      return;
    }
    const edges = this.edges(),
      log = edges[0] + ((bottom - y) / (bottom - top)) * (edges[edges.length - 1] - edges[0]);
    const line = Math.min(this.lines.length - 1, Math.max(0, edges.findIndex((e) => e > log) - 1)),
      i = Math.floor(((x - left) / (right - left)) * cells.columns);
    this.tell(i, line);
  }

  /**
   * Show the value of a cell.
   *
   * @param {number} i column
   * @param {number} line
   */
  tell(i, line) {
    const { cells } = this;
    if (!cells) return;
    const place = cells.low + (i + 0.5) * cells.step;
    this.hover.textContent = `${cells.moving ? `${fixed(place, 3)} ${this.schedule.unit}` : moment(place, true)} · ${hertz(this.lines[line])} Hz · ${this.value(this.values[i][line])}`;
  }

  get words() {
    return WORDS[this.what];
  }

  get unit() {
    return this.what === "coherence" ? "γ²" : "dB";
  }

  /** @param {number} value */
  value(value) {
    return this.what === "coherence" ? `γ² ${plain(value, 3)}` : `${signed(value, 2)} dB`;
  }
}

/**
 * @param {number} low
 * @param {number} reach
 */
function fifths(low, reach) {
  const places = Math.min(9, Math.max(0, 1 - Math.floor(Math.log10(reach / 4))));
  return Array.from({ length: 5 }, (_, i) => Number((low + (reach * i) / 4).toFixed(places)));
}

/** @param {number} high */
const reachDigits = (high) => (high < 1 ? 2 : 1);
