// @ts-check
// Magnitude, phase and coherence over logarithmic frequency: measured with its band, reference, baseline, model.
import { axis, chart, degreeTicks, frequencyAxis, steady } from "./chart.js";
import { extent, moved, NAMES, overGrid, turns } from "./curves.js";
import { byFinger } from "./finger.js";
import { tr } from "./language.js";
import { colour } from "./theme.js";
import { mark } from "./words.js";

/** @import { Chart, Range } from "./chart.js" */
/** @import { Curve, Values } from "./curves.js" */
/** @import { Curves, Found, Frame, Run } from "./messages.js" */

const FEW_LINES = 40;
/** @type {Record<Curves, number[]>} */
const DASHES = { measured: [], reference: [8, 4], baseline: [2, 3], model: [5, 2] };

// What each panel draws of a curve: its value, the edges of its band, and the values that differ from zero.
const MAGNITUDE = /** @type {const} */ ({ value: "db", edges: ["dbHigh", "dbLow"], sure: "dbSure", room: 3 });
const PHASE = /** @type {const} */ ({ value: "deg", edges: ["degHigh", "degLow"], sure: "degSure", room: 10 });
const PANELS = /** @type {const} */ ([MAGNITUDE, PHASE, { value: "coherence", edges: [] }]);

export class Bode {
  /**
   * @param {HTMLElement[]} hosts of magnitude, phase and coherence
   * @param {(hz: number, found: Found) => void} onCursor
   */
  constructor(hosts, onCursor) {
    this.hosts = hosts;
    this.onCursor = onCursor;
    this.shown = new Set(NAMES);
    /** @type {Partial<Record<Curves, Curve>>} */
    this.curves = {};
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
    /** @type {Range} */
    this.whole = [1, 10];
    /** @type {Range} */
    this.sight = this.whole;
    this.ranges = [steady({ step: 5, least: 10 }), steady({ step: 15, least: 30 })];
    this.line = 0;
  }

  /**
   * Start again with these lines.
   *
   * @param {Run} facts
   * @param {string} unit
   * @param {string} symbol
   */
  begin(facts, unit, symbol) {
    this.clear();
    this.lines = facts.frequency_hz;
    this.grid = facts.grid_hz;
    this.at = this.lines.map((f) =>
      this.grid.reduce((best, g, i) => (Math.abs(g - f) < Math.abs(this.grid[best] - f) ? i : best), 0),
    );
    this.line = Math.min(this.line, this.lines.length - 1);
    this.ranges = [steady({ step: 5, least: 10 }), steady({ step: 15, least: 30 })];
    this.nothing = new Array(this.grid.length).fill(null);
    const low = this.grid[0],
      high = this.grid[this.grid.length - 1],
      pad = (high / low) ** 0.03 || 1.1;
    this.whole = [low / Math.max(pad, 1.02), high * Math.max(pad, 1.02)];
    this.sight = this.whole;
    this.charts = [
      this.panel(
        0,
        unit ? tr("|{symbol}| in dB re 1 {unit}", { symbol, unit }) : tr("|{symbol}| in dB", { symbol }),
        { range: () => this.limits(0, MAGNITUDE) },
        false,
      ),
      this.panel(1, tr("phase in °"), { range: () => this.limits(1, PHASE) }, false, { splits: degreeTicks }),
      this.panel(2, tr("coherence"), { range: [-0.05, 1.08] }, true, { splits: () => [0, 0.5, 1] }),
    ];
  }

  // Show nothing until the next `begin`.
  clear() {
    for (const made of this.charts) made.destroy();
    this.charts = [];
    this.curves = {};
  }

  /**
   * @param {number} index
   * @param {string} label
   * @param {uPlot.Scale} y
   * @param {boolean} last
   * @param {uPlot.Axis} more
   */
  panel(index, label, y, last, more = {}) {
    const lines = () => this.lines;
    const few = this.lines.length <= FEW_LINES;
    /** @type {uPlot.Series[]} */
    const series = [{ label: "frequency" }];
    /** @type {uPlot.Band[]} */
    const bands = [];
    for (const name of NAMES) {
      const show = this.shown.has(name);
      const first = series.length;
      const points = {
        show: name === "measured" && few,
        size: 7,
        fill: () => colour("measured"),
        stroke: () => colour("measured"),
      };
      series.push({
        label: name,
        show,
        stroke: () => colour(name),
        width: name === "measured" ? 2 : 1.6,
        dash: DASHES[name],
        points,
      });
      if (index === 2 || name === "model") continue;
      for (const edge of ["high", "low"])
        series.push({ label: `${name} ${edge}`, show, stroke: () => "transparent", width: 0, points: { show: false } });
      bands.push({ series: [first + 1, first + 2], fill: () => `${colour(name)}${name === "measured" ? "38" : "24"}` });
    }
    return chart(
      this.hosts[index],
      {
        scales: { x: { distr: 3, time: false, range: () => this.sight }, y },
        axes: [
          frequencyAxis(lines, last ? tr("frequency in Hz") : ""),
          axis(label, { size: 44, values: (_u, s) => s.map(mark), ...more }),
        ],
        series,
        bands,
        cursor: {
          sync: { key: "bode" },
          points: { show: false },
          drag: { x: true, y: false, setScale: false },
          y: false,
          bind: {
            dblclick: () => () => {
              this.zoom(this.whole);
              return null;
            },
          },
        },
        hooks: {
          ready: [
            (u) =>
              byFinger(
                u,
                () => this.select(u),
                () => this.zoom(this.whole),
              ),
          ],
          setCursor: [(u) => this.follow(u)],
          setSelect: [(u) => this.select(u)],
          draw: [(u) => this.mark(u)],
        },
      },
      this.data(index),
    );
  }

  /**
   * @param {number} index
   * @returns {[number[], ...Values[]]}
   */
  data(index) {
    const { value, edges } = PANELS[index];
    /** @type {[number[], ...Values[]]} */
    const found = [this.grid];
    for (const name of NAMES) {
      const curve = this.curves[name],
        by = value === "deg" && curve ? curve.turns : 0;
      for (const key of name === "model" ? [value] : [value, ...edges])
        found.push(curve ? moved(curve[key], by) : this.nothing);
    }
    return found;
  }

  /**
   * @param {number} index
   * @param {typeof MAGNITUDE | typeof PHASE} panel
   */
  limits(index, { value, edges, sure, room }) {
    const drawn = NAMES.flatMap((name) => (this.shown.has(name) && this.curves[name]) || []);
    /** @type {(curve: Curve, values: Values) => Values} */
    const by = (curve, values) => moved(values, value === "deg" ? curve.turns : 0);
    const certain = drawn.map((curve) => by(curve, curve[sure]));
    const known = certain.some((values) => values.some(Number.isFinite));
    const bounds = drawn.flatMap((curve) => edges.map((edge) => by(curve, curve[edge])));
    const all = drawn.map((curve) => by(curve, curve[value]));
    // A measured point is always in the picture; only its band may leave it.
    const points = drawn.flatMap((curve, i) => (curve === this.curves.measured ? [all[i]] : []));
    return this.ranges[index](...extent(known ? [...certain, ...points] : all, [...bounds, ...all], room));
  }

  /**
   * A frame of a curve; drawn at the next `draw`.
   *
   * @param {Frame} frame
   */
  take(frame) {
    const name = NAMES.find((known) => known === frame.kind) ?? "measured";
    this.curves[name] = overGrid(frame, this.grid, this.at);
  }

  /** @param {Curves} name */
  drop(name) {
    delete this.curves[name];
  }

  draw() {
    const measured = this.curves.measured;
    for (const name of NAMES) {
      const curve = this.curves[name];
      if (curve) curve.turns = name === "measured" || !measured ? 0 : turns(curve, measured);
    }
    for (const [index, made] of this.charts.entries()) made.setData(this.data(index));
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
        if (i && String(label).split(" ")[0] === name && now !== show) made.setSeries(i, { show });
    this.draw();
  }

  /** @param {Range} sight */
  zoom(sight) {
    this.sight = sight;
    for (const made of this.charts) made.setData(made.data);
  }

  /** @param {Chart} u */
  select(u) {
    const { left, width } = u.select;
    if (width > 8) this.zoom([u.posToVal(left, "x"), u.posToVal(left + width, "x")]);
    u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
  }

  /** @param {Chart} u */
  follow(u) {
    const { left } = u.cursor;
    if (left === undefined || left < 0) return;
    const f = u.posToVal(left, "x");
    this.line = this.lines.reduce(
      (best, g, i) => (Math.abs(Math.log(g / f)) < Math.abs(Math.log(this.lines[best] / f)) ? i : best),
      0,
    );
    this.tell();
    this.ring();
  }

  /**
   * The next or the previous line under the cursor.
   *
   * @param {number} by
   */
  step(by) {
    if (!this.charts.length) return;
    this.line = Math.min(this.lines.length - 1, Math.max(0, this.line + by));
    this.tell();
    this.ring();
  }

  ring() {
    for (const made of this.charts) made.redraw(false, false);
  }

  /**
   * A ring around the measured value at the line under the cursor.
   *
   * @param {Chart} u
   */
  mark(u) {
    const index = this.charts.indexOf(u),
      at = this.at[this.line],
      f = this.lines[this.line];
    if (index < 0 || f < this.sight[0] || f > this.sight[1]) return;
    const x = u.valToPos(f, "x", true),
      ctx = u.ctx;
    ctx.save();
    ctx.strokeStyle = colour("muted");
    ctx.setLineDash([3, 4]);
    ctx.beginPath();
    ctx.moveTo(x, u.bbox.top);
    ctx.lineTo(x, u.bbox.top + u.bbox.height);
    ctx.stroke();
    ctx.setLineDash([]);
    ctx.lineWidth = 2 * devicePixelRatio;
    const value = u.data[1][at];
    if (value !== null && value !== undefined && Number.isFinite(value) && this.shown.has("measured")) {
      ctx.strokeStyle = colour("ink");
      ctx.beginPath();
      ctx.arc(x, u.valToPos(value, "y", true), 6.5 * devicePixelRatio, 0, 7);
      ctx.stroke();
    }
    ctx.restore();
  }

  tell() {
    const at = this.at[this.line];
    /** @type {Found} */
    const found = {};
    for (const name of NAMES) {
      const curve = this.curves[name];
      if (!curve || !this.shown.has(name)) continue;
      const i = curve.frame.columns === this.grid.length && name === "model" ? at : this.line;
      found[name] = {
        db: curve.frame.magnitude[i],
        deg: curve.frame.phase[i] + curve.turns,
        reach: curve.frame.reach[i],
        coherence: curve.frame.coherence[i],
        frame: curve.frame,
      };
    }
    this.onCursor(this.lines[this.line], found);
  }
}
