// @ts-check
// One quantity of many runs over the time of day: points with their bounds, baselines, and more of a run when zoomed.
import { axis, chart } from "./chart.js";
import { gestures } from "./gestures.js";
import { language, tr } from "./language.js";
import { element } from "./make.js";
import { bounded, dateTime, pageOf, quantity as words } from "./runs_words.js";
import { colour } from "./theme.js";
import { ALARMS, nearest, reach } from "./trends_data.js";
import { worded } from "./worded.js";
import { plain } from "./words.js";
import { scaled, shifted } from "./zoom.js";

/** @import { Chart, Range } from "./chart.js" */
/** @import { BaselineMark, Point, Quantity } from "./trends_data.js" */
/** @typedef {{at: number[], value: number[], bound: number[]}} Detail Many fits of a run. */
/** @typedef {{onZoom: (range: Range | null) => void, onOpen: (run: string, timeS: number) => void}} Listeners */

const LOCALE = language.code === "en" ? "en-GB" : language.code;
const DAY_S = 86400;
const YEAR = new Intl.DateTimeFormat(LOCALE, { year: "numeric", month: "short" }),
  DAY = new Intl.DateTimeFormat(LOCALE, { day: "numeric", month: "short" }),
  TIME = new Intl.DateTimeFormat(LOCALE, { hour: "2-digit", minute: "2-digit", hourCycle: "h23" });

/**
 * Marks of an axis of dates: months, days or times of day.
 *
 * @param {number[]} splits
 * @param {number} stepS
 */
export function dateTicks(splits, stepS) {
  const format = stepS >= 28 * DAY_S ? YEAR : stepS >= DAY_S ? DAY : TIME;
  return splits.map((unixS, i) => {
    const date = new Date(1000 * unixS);
    // The first of the times, and each first of a day, also has the date.
    const day = format === TIME && (i === 0 || date.getHours() + date.getMinutes() === 0);
    return day ? DAY.format(date) : format.format(date);
  });
}

export class TrendChart {
  /**
   * @param {HTMLElement} host
   * @param {Listeners} listeners
   */
  constructor(host, listeners) {
    this.listeners = listeners;
    /** @type {Quantity} */
    this.quantity = { model: "", name: "", unit: "", points: [] };
    /** @type {BaselineMark[]} */
    this.marks = [];
    /** @type {Detail[]} */
    this.details = [];
    /** @type {Range} */
    this.range = [0, 1];
    this.at = -1;
    this.title = element("h2");
    this.plot = element("div", { class: "plot", tabindex: 0, role: "group" });
    this.readout = element("p", { class: "read", "aria-live": "polite" });
    this.card = element("section", { class: "trend-card" }, this.title, this.plot, this.readout);
    host.append(this.card);
    this.plot.addEventListener("keydown", (event) => this.key(event));
    /** @type {Chart | null} */
    this.made = null;
  }

  build() {
    const made = chart(
      this.plot,
      {
        padding: [6, 24, 0, 0],
        scales: { x: { time: true, range: () => this.range }, y: { range: () => this.reach() } },
        axes: [
          axis("", { size: 20, space: 74, values: (_u, splits, _i, _space, step) => dateTicks(splits, step) }),
          axis("", { size: 58, space: 24, values: (_u, splits) => splits.map((v) => this.mark(v)) }),
        ],
        series: [{}, { paths: () => null, points: { show: false } }],
        cursor: {
          y: false,
          points: { show: false },
          drag: { x: false, y: false, setScale: false },
        },
        hooks: {
          draw: [(u) => this.paint(u)],
          setCursor: [(u) => this.hover(u)],
        },
      },
      [[], []],
    );
    gestures(made, this.actions(), "x");
    return made;
  }

  /** @returns {import("./gestures.js").Gestures} */
  actions() {
    const at = (/** @type {number} */ share) => this.range[0] + share * (this.range[1] - this.range[0]);
    return {
      scale: (x, _y, factor) => this.see(scaled(this.range, at(x), factor, false)),
      shift: (x) => this.see(shifted(this.range, x, false)),
      box: (x) => x && this.see([at(x[0]), at(x[1])]),
      // A finger first shows the run; its link in the text below opens it.
      place: (_second, touch) => touch || this.open(),
      reset: () => this.listeners.onZoom(null),
    };
  }

  /** Show this range of time, or all of it where it contains every point. @param {Range} range */
  see(range) {
    const { points } = this.quantity,
      all = points.length > 0 && range[0] <= points[0].at && range[1] >= points[points.length - 1].at;
    this.listeners.onZoom(all ? null : range);
  }

  /** @param {number} value */
  mark(value) {
    return this.quantity.name === ALARMS && value % 1 ? "" : plain(value, 5);
  }

  /** Points within the range of time. */
  get inside() {
    return this.quantity.points.filter(({ at }) => at >= this.range[0] && at <= this.range[1]);
  }

  /** @returns {Range} */
  reach() {
    if (this.quantity.name === ALARMS) return [0, Math.max(1, ...this.inside.map(({ value }) => value)) * 1.15];
    return reach(this.inside);
  }

  /**
   * @param {Quantity} quantity
   * @param {BaselineMark[]} marks
   * @param {Range} range
   * @param {Detail[]} details
   */
  take(quantity, marks, range, details) {
    const run = this.at < 0 ? "" : this.quantity.points[this.at]?.run;
    Object.assign(this, { quantity, marks, range, details });
    this.at = quantity.points.findIndex((point) => point.run === run);
    const { points, unit, model, name, shared } = quantity;
    const last = points.at(-1);
    const text = name === ALARMS ? tr("Alarms in each run") : shared ? `${words(name)}, ${model}` : words(name);
    const now = last ? (name === ALARMS ? String(last.value) : bounded(last.value, last.bound, unit)) : "–";
    this.title.replaceChildren(text, element("span", {}, tr("last: {value}", { value: now })));
    this.card.dataset.name = model ? `${model}/${name}` : name;
    const [from, to] = [points[0], last].map((point) => (point ? dateTime(point.at) : "–"));
    this.plot.setAttribute("aria-label", this.about({ quantity: text, count: points.length, from, to, value: now }));
    this.made ??= this.build();
    this.made.setData([points.map(({ at }) => at), points.map(({ value }) => value)]);
    this.read();
  }

  /** @param {Record<"quantity" | "from" | "to" | "value", string> & {count: number}} facts */
  about(facts) {
    return tr("{quantity}, {count} runs from {from} to {to}; last: {value}", facts);
  }

  /**
   * What is drawn above the points.
   *
   * @param {Chart} _u
   */
  finish(_u) {}

  /** @param {Chart} u */
  paint(u) {
    const { ctx } = u;
    ctx.save();
    ctx.beginPath();
    ctx.rect(u.bbox.left, u.bbox.top, u.bbox.width, u.bbox.height);
    ctx.clip();
    const scale = devicePixelRatio;
    ctx.lineWidth = scale;
    ctx.strokeStyle = colour("baseline");
    ctx.setLineDash([5 * scale, 4 * scale]);
    for (const { at } of this.marks) stroke(u, at, -Infinity, Infinity);
    ctx.setLineDash([]);
    ctx.strokeStyle = colour("band");
    for (const detail of this.details)
      detail.at.forEach((at, i) => {
        stroke(u, at, detail.value[i] - detail.bound[i], detail.value[i] + detail.bound[i]);
      });
    ctx.fillStyle = colour("muted");
    for (const detail of this.details) for (const [i, at] of detail.at.entries()) dot(u, at, detail.value[i], 1.2);
    for (const [i, point] of this.quantity.points.entries()) this.point(u, point, i === this.at);
    this.finish(u);
    ctx.restore();
  }

  /**
   * @param {Chart} u
   * @param {Point} point
   * @param {boolean} chosen
   */
  point(u, { at, value, bound, low, high, written }, chosen) {
    const { ctx } = u,
      scale = devicePixelRatio;
    const alarm = this.quantity.name === ALARMS && value > 0;
    ctx.strokeStyle = colour("band");
    ctx.lineWidth = 4 * scale;
    if (this.quantity.name !== ALARMS) stroke(u, at, low, high);
    ctx.lineWidth = 1.6 * scale;
    ctx.strokeStyle = colour(alarm ? "alarm" : "measured");
    ctx.fillStyle = written ? colour("paper") : ctx.strokeStyle;
    stroke(u, at, alarm ? 0 : value - bound, alarm ? value : value + bound);
    dot(u, at, value, chosen ? 5.5 : 3, true);
  }

  /** @param {Chart} u */
  hover(u) {
    if (u.cursor.left === undefined || u.cursor.left === null || u.cursor.left < 0) return;
    this.choose(nearest(this.quantity.points, u.posToVal(u.cursor.left, "x")));
  }

  /** @param {number} at */
  choose(at) {
    if (at === this.at || !this.quantity.points[at]) return;
    this.at = at;
    this.read();
    this.made?.redraw(false);
  }

  read() {
    const point = this.quantity.points[this.at];
    if (!point) {
      this.readout.replaceChildren("\u00a0");
      return;
    }
    const { run, at, value, bound, low, high, timeS, message } = point;
    const unit = this.quantity.unit;
    const within = tr("90 %: {low} … {high}", { low: plain(low), high: plain(high) });
    const text =
      this.quantity.name === ALARMS
        ? [value, worded(message ?? "")].filter((part) => part !== "").join(" · ")
        : `${bounded(value, bound, unit)} (${within})`;
    const link = element("a", { href: pageOf(run, timeS), class: "name" }, run);
    this.readout.replaceChildren(link, ` ${dateTime(at)}: ${text}`);
  }

  open() {
    const point = this.quantity.points[this.at];
    if (point) this.listeners.onOpen(point.run, point.timeS);
  }

  /** @param {KeyboardEvent} event */
  key(event) {
    const last = this.quantity.points.length - 1;
    const to = {
      ArrowLeft: this.at < 0 ? last : Math.max(0, this.at - 1),
      ArrowRight: Math.min(last, this.at + 1),
      Home: 0,
      End: last,
    }[event.key];
    if (to !== undefined) this.choose(to);
    else if (event.key === "Enter") this.open();
    else if (event.key === "Escape") this.listeners.onZoom(null);
    else return;
    event.preventDefault();
  }

  remove() {
    this.made?.destroy();
    this.card.remove();
  }
}

/**
 * A vertical line between two values.
 *
 * @param {Chart} u
 * @param {number} at
 * @param {number} low
 * @param {number} high
 */
export function stroke(u, at, low, high) {
  const x = u.valToPos(at, "x", true);
  const bottom = low === -Infinity ? u.bbox.top + u.bbox.height : u.valToPos(low, "y", true);
  const top = high === Infinity ? u.bbox.top : u.valToPos(high, "y", true);
  u.ctx.beginPath();
  u.ctx.moveTo(x, bottom);
  u.ctx.lineTo(x, top);
  u.ctx.stroke();
}

/**
 * @param {Chart} u
 * @param {number} at
 * @param {number} value
 * @param {number} radius
 */
export function dot(u, at, value, radius, edge = false) {
  u.ctx.beginPath();
  u.ctx.arc(u.valToPos(at, "x", true), u.valToPos(value, "y", true), radius * devicePixelRatio, 0, 2 * Math.PI);
  u.ctx.fill();
  if (edge) u.ctx.stroke();
}
