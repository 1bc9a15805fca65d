// @ts-check
// Magnitude, phase and coherence over frequency: the measured curve, references, baseline and model, in one view.
import { chosen, remember } from "./address.js";
import { computed, operationOf } from "./arithmetic.js";
import { steady } from "./chart.js";
import { Cursors } from "./cursors.js";
import { curveOf, extent, LISTED, moved, NAMES, overGrid, turns } from "./curves.js";
import { next } from "./extrema.js";
import { marked } from "./marks.js";
import { mostlyNoise, NoiseHold } from "./noise-hold.js";
import { panel } from "./panel.js";
import { aloneAt, others } from "./parts.js";
import { Tooltip } from "./tooltip.js";
import { View } from "./view.js";
import { scaled, shifted, Zoom } from "./zoom.js";

/** @import { Operation } from "./arithmetic.js" */
/** @import { Chart, Range } from "./chart.js" */
/** @import { Curve, Drawn, Values } from "./curves.js" */
/** @import { Extremum } from "./extrema.js" */
/** @import { Mode } from "./fitted.js" */
/** @import { Mark } from "./marks.js" */
/** @import { Annotation, Curves, Derived, Found, Frame, Quantity, Run } from "./messages.js" */

const FEW_LINES = 40;
const STEP = 0.7; // of a zoom by key or button

// What each panel draws of a curve: its value, the edges of its band, and the values that differ from zero.
export const MAGNITUDE = /** @type {const} */ ({ value: "db", edges: ["dbHigh", "dbLow"], sure: "dbSure", room: 3 });
export const PHASE = /** @type {const} */ ({ value: "deg", edges: ["degHigh", "degLow"], sure: "degSure", room: 10 });
export const PANELS = /** @type {const} */ ([MAGNITUDE, PHASE, { value: "coherence", edges: [] }]);

/**
 * What the plot shows that other parts of the page know.
 *
 * @typedef {object} Known
 * @property {() => Mark[]} margins of the loop at the time shown
 * @property {() => void} laid called when other curves are shown
 * @property {() => Mode[]} modes of the fitted model at the time shown
 */

export class Bode {
  /**
   * @param {HTMLElement[]} hosts of magnitude, phase and coherence
   * @param {(hz: number, found: Found) => void} onCursor
   * @param {Known} known
   */
  constructor(hosts, onCursor, known) {
    this.hosts = hosts;
    this.onCursor = onCursor;
    this.known = known;
    this.view = new View();
    this.zooming = new Zoom();
    this.cursors = new Cursors();
    this.hold = new NoiseHold();
    this.tooltip = new Tooltip();
    this.shown = new Set(NAMES);
    /** Indices of the parts besides noise that the bounds of this run have had. @type {Set<number>} */
    this.parts = new Set();
    /** Whether the charts have the parts of the bound. */
    this.parted = false;
    /** In the displayed quantity, at their own frequencies. @type {Partial<Record<Curves, Curve>>} */
    this.curves = {};
    /** The same over the grid, in the view. @type {Partial<Record<Curves, Drawn>>} */
    this.drawn = {};
    /** The curves that the charts have series for. @type {Curves[]} */
    this.laid = [];
    /** @type {Operation | null} */
    this.operation = operationOf(chosen("bode-operation", ""));
    /** What an addition of the page computes from the measured curve. @type {Derived | null} */
    this.derived = null;
    /** @type {Extremum | null} */
    this.extremum = null;
    /** @type {Annotation[]} */
    this.annotations = [];
    /** @type {Chart[]} */
    this.charts = [];
    /** @type {number[]} frequencies of the lines, Hz */
    this.lines = [];
    /** @type {number[]} frequencies at which the curves are drawn, Hz */
    this.grid = [];
    /** @type {number[]} index in the grid of each line */
    this.at = [];
    /** @type {Values} */
    this.nothing = [];
    this.symbol = "";
    /** Units of the quantity times (jω)^n, n = −2 … 2. @type {string[]} */
    this.unitsSi = [];
    /** Whether a quantity of the run has other units in the source. */
    this.ofDrive = false;
    /** @type {Quantity | null} */
    this.quantity = null;
    this.line = 0;
    /** Whether the cursor has its first place, or a person has moved it. */
    this.aimed = false;
    /** What shows the curves instead of the three charts. @type {import("./plane.js").Plane | null} */
    this.plane = null;
  }

  get sight() {
    return this.zooming.sight;
  }

  get whole() {
    return this.zooming.whole;
  }

  /** Those that are shown. */
  get units() {
    const { inDrive, drive } = this.view;
    return inDrive && drive ? drive.units : this.unitsSi;
  }

  /** The curve that the ring is around. @returns {Curves} */
  get main() {
    return this.operation ? "result" : "measured";
  }

  // Few lines are points with error bars; nothing is known between them.
  get few() {
    return this.lines.length <= FEW_LINES;
  }

  /**
   * Start again with these lines.
   *
   * @param {Run} facts
   * @param {Quantity} quantity
   */
  begin(facts, quantity) {
    this.clear();
    const of = facts.quantities.find(({ name }) => name === quantity);
    this.quantity = quantity;
    this.symbol = of?.symbol ?? "";
    this.unitsSi = of?.units ?? [];
    this.view.drive = of?.drive ?? null;
    this.ofDrive = facts.quantities.some(({ drive }) => drive);
    if (this.lines.join() !== facts.frequency_hz.join()) this.aimed = false;
    this.lines = facts.frequency_hz;
    this.grid = facts.grid_hz;
    this.at = this.lines.map((f) =>
      this.grid.reduce((best, g, i) => (Math.abs(g - f) < Math.abs(this.grid[best] - f) ? i : best), 0),
    );
    this.line = Math.min(this.line, this.lines.length - 1);
    this.nothing = new Array(this.grid.length).fill(null);
    const low = this.grid[0],
      high = this.grid[this.grid.length - 1],
      pad = Math.max((high / low) ** 0.03 || 1.1, 1.02);
    this.zooming.begin([low / pad, high * pad], `${facts.axis} ${quantity}`);
    this.build();
  }

  // Show nothing until the next `begin`.
  clear() {
    for (const made of this.charts) made.destroy();
    this.charts = [];
    this.curves = {};
    this.drawn = {};
    this.parts.clear();
    this.extremum = null;
  }

  /** The curves that are to be drawn. @returns {Curves[]} */
  layout() {
    if (this.operation) return ["result"];
    /** @param {Curves} name */
    const optional = (name) => name === "what if" || name.startsWith("reference");
    return NAMES.filter((name) => name !== "result" && (!optional(name) || this.curves[name]));
  }

  /** Whether the bound of the measured curve is to be drawn in parts. */
  get partedNow() {
    return this.view.inParts && this.parts.size > 0;
  }

  /** Whether this curve has a band in parts. @param {Curves} name */
  banded(name) {
    return this.parted && name === "measured" && !this.few;
  }

  // Charts for the curves and the options of the view; data follow with `draw`.
  build() {
    for (const made of this.charts) made.destroy();
    this.tooltip.hide();
    this.laid = this.layout();
    this.parted = this.partedNow;
    this.hold = new NoiseHold();
    this.ranges = [steady({ step: 5, least: 10 }), steady({ step: 15, least: 30 })];
    this.charts = [];
    if (this.plane) this.charts.push(this.plane.build());
    else for (const index of PANELS.keys()) this.charts.push(panel(this, index));
    this.known.laid();
  }

  // The options of the view have changed.
  rebuild() {
    this.drawn = {};
    this.extremum = null;
    if (!this.charts.length) return;
    this.build();
    this.draw();
  }

  /**
   * @param {number} index
   * @returns {[number[], ...Values[]]}
   */
  data(index) {
    const { value, edges } = PANELS[index];
    /** @type {[number[], ...Values[]]} */
    const found = [this.grid];
    for (const name of this.laid) {
      const curve = this.drawn[name],
        by = value === "deg" && curve ? curve.turns : 0;
      for (const key of name === "model" ? [value] : [value, ...edges])
        found.push(curve ? moved(curve[key], by) : this.nothing);
      if (this.banded(name) && edges.length)
        for (const part of curve ? curve.inner() : [null, null])
          for (const edge of edges) found.push(part ? moved(part[edge], by) : this.nothing);
    }
    return found;
  }

  /**
   * The series of a curve's values in a chart.
   *
   * @param {number} index
   * @param {Curves} name
   */
  seriesOf(index, name) {
    return this.charts[index].series.findIndex(({ label }) => label === name);
  }

  /**
   * The visible range of a chart.
   *
   * @param {0 | 1} index
   * @returns {Range}
   */
  limits(index) {
    const chosenRange = this.zooming.heights[index];
    if (chosenRange) return chosenRange;
    const { value, edges, sure, room } = index ? PHASE : MAGNITUDE;
    if (index && this.view.wrapped) return [-190, 190];
    const names = this.laid.filter((name) => this.shown.has(name) && this.drawn[name]);
    const drawn = names.flatMap((name) => this.drawn[name] ?? []);
    /** @type {(curve: Drawn, values: Values) => Values} */
    const by = (curve, values) => moved(values, index ? curve.turns : 0);
    const certain = drawn.map((curve) => by(curve, curve[sure]));
    const known = certain.some((values) => values.some(Number.isFinite));
    const bounds = drawn.flatMap((curve) => edges.map((edge) => by(curve, curve[edge])));
    const all = drawn.map((curve) => by(curve, curve[value]));
    // A measured point is always in the picture; only its band may leave it.
    const points = all.filter((_, i) => names[i] === this.main);
    const steadily = this.ranges?.[index] ?? steady({ step: 5, least: 10 });
    const within = [...(known ? [...certain, ...points] : all), marked(this, index)];
    const follow = () => steadily(...extent(within, [...bounds, ...all], room));
    const { measured } = this.curves;
    return index && measured ? this.hold.range(mostlyNoise(measured), follow) : follow();
  }

  /**
   * A frame of a curve; drawn at the next `draw`.
   *
   * @param {Frame} frame
   */
  take(frame) {
    const name = NAMES.find((known) => known === frame.kind) ?? "measured";
    this.curves[name] = curveOf(frame, this.lines, this.grid, this.at);
    delete this.drawn[name];
  }

  /** @param {Curves} name */
  drop(name) {
    delete this.curves[name];
    delete this.drawn[name];
  }

  /** Show a curve that is computed from two others; null: the curves themselves. @param {Operation | null} operation */
  compute(operation) {
    this.operation = operation;
    remember("bode-operation", operation ? [operation.kind, operation.a, operation.b].join("~") : "", "");
    this.zooming.heights.fill(null);
    this.zooming.note();
    this.drop("result");
    this.rebuild();
  }

  draw() {
    if (!this.charts.length) return;
    if (this.operation) {
      this.drop("result");
      const result = computed(this.operation, this.curves, this.lines, this.at);
      if (result) this.curves.result = result;
    }
    this.drop("what if");
    const { measured: known } = this.curves,
      other = known && !this.operation ? this.derived?.curve(known) : null;
    if (other) this.curves["what if"] = other;
    const before = this.parts.size;
    if (known) for (const part of others(known)) this.parts.add(part);
    if (this.layout().join() !== this.laid.join() || this.partedNow !== this.parted) this.build();
    else if (this.parts.size > before) this.known.laid();
    const ratio = this.operation?.kind === "ratio";
    for (const name of this.laid) {
      const curve = this.curves[name];
      if (curve) this.drawn[name] ??= overGrid(curve, this.view.of(curve, ratio), this.grid.length);
    }
    const measured = this.drawn.measured;
    for (const name of this.laid) {
      const curve = this.drawn[name];
      if (curve)
        curve.turns =
          name === "measured" || name === "what if" || !measured || this.view.wrapped ? 0 : turns(curve, measured);
    }
    for (const [index, made] of this.charts.entries()) made.setData(this.plane ? this.plane.data() : this.data(index));
    this.tell();
  }

  /**
   * @param {Curves} name
   * @param {boolean} show
   */
  toggle(name, show) {
    if (show) this.shown.add(name);
    else this.shown.delete(name);
    for (const made of this.charts)
      for (const [i, { label, show: now }] of made.series.entries())
        if (i && String(label).replace(/ (high|low)$/, "") === name && now !== show) made.setSeries(i, { show });
    this.draw();
  }

  // The visible ranges have changed.
  zoomed() {
    for (const made of this.charts) made.setData(made.data);
  }

  /** @param {Range} sight */
  zoom(sight) {
    this.zooming.across(sight);
    this.zoomed();
  }

  reset() {
    this.plane?.see(null);
    this.zooming.reset();
    this.zoomed();
  }

  /**
   * Zoom around the cursor by a key or a button.
   *
   * @param {boolean} closer
   */
  magnify(closer) {
    if (this.plane) return this.plane.magnify(closer);
    const f = this.lines[this.line],
      inside = f > this.sight[0] && f < this.sight[1];
    const at = inside ? f : Math.sqrt(this.sight[0] * this.sight[1]);
    this.zoom(scaled(this.sight, at, closer ? STEP : 1 / STEP, !this.view.linear));
  }

  /** @param {number} share */
  shift(share) {
    if (this.plane) return this.plane.shift(share, 0);
    const [low, high] = shifted(this.sight, share, !this.view.linear);
    if (low >= this.whole[0] && high <= this.whole[1]) this.zoom([low, high]);
  }

  /** @param {Chart} u */
  follow(u) {
    const { left, top } = u.cursor;
    if (left === undefined || top === undefined || left < 0) {
      this.tooltip.hide();
      return;
    }
    const f = u.posToVal(left, "x");
    this.go(f);
    if (u.over.matches(":hover")) this.tooltip.show(u, this.lines[this.line], this.valuesAt(this.line), this.view);
  }

  /** The cursor to the line nearest to a frequency. @param {number} hz */
  go(hz) {
    this.aimed = true;
    this.line = this.nearest(hz);
    this.tell();
    this.ring();
  }

  /** @param {number} hz */
  nearest(hz) {
    return this.lines.reduce(
      (best, g, i) => (Math.abs(Math.log(g / hz)) < Math.abs(Math.log(this.lines[best] / hz)) ? i : best),
      0,
    );
  }

  /**
   * The next or the previous line under the cursor.
   *
   * @param {number} by
   */
  step(by) {
    if (!this.charts.length) return;
    this.aimed = true;
    this.line = Math.min(this.lines.length - 1, Math.max(0, this.line + by));
    this.tell();
    this.ring();
  }

  /** Fix cursor A, or B, at the line under the cursor. @param {boolean} second */
  place(second) {
    if (!this.charts.length) return;
    this.cursors.place(second, this.lines[this.line]);
    this.tell();
    this.ring();
  }

  /** No fixed cursors, no marked peak. */
  unplace() {
    this.cursors.clear();
    this.extremum = null;
    this.tell();
    this.ring();
  }

  /**
   * The next peak or antiresonance to the right, or to the left: of the model, which is known between the lines, or of
   * the measured curve.
   *
   * @param {boolean} right
   */
  seek(right) {
    const name = this.laid.find((n) => n === "model" && this.curves.model && this.shown.has(n)) ?? this.main,
      curve = this.curves[name];
    if (!curve) return;
    const { db } = this.view.of(curve, this.operation?.kind === "ratio");
    const from = this.extremum?.hz ?? this.lines[this.line];
    const found = next(curve.hz, db, curve.reach, from, right);
    if (!found) return;
    this.extremum = { ...found, of: name };
    this.go(found.hz);
  }

  ring() {
    for (const made of this.charts) made.redraw(false, false);
  }

  /**
   * Values of all visible curves at a line, in the view.
   *
   * @param {number} line
   * @returns {Found}
   */
  valuesAt(line) {
    /** @type {Found} */
    const found = {};
    const at = this.at[line];
    for (const name of LISTED.filter((listed) => this.laid.includes(listed))) {
      const curve = this.curves[name],
        drawn = this.drawn[name];
      if (!curve || !drawn || !this.shown.has(name)) continue;
      const i = curve.index === this.at ? line : at;
      found[name] = {
        db: drawn.db[at] ?? NaN,
        deg: (drawn.deg[at] ?? NaN) + drawn.turns,
        reach: curve.reach[i],
        parts: aloneAt(curve, i),
        coherence: curve.coherence[i],
        frame: curve.frame,
      };
    }
    return found;
  }

  tell() {
    this.onCursor(this.lines[this.line], this.valuesAt(this.line));
  }
}
