// @ts-check
// The curves in the complex plane (Nyquist, equal scales) or as magnitude over phase (Nichols): one chart and its zoom.
import { chosen, remember } from "./address.js";
import { axis, chart, degreeTicks } from "./chart.js";
import { gestures } from "./gestures.js";
import { tr } from "./language.js";
import { ofLoop } from "./marks.js";
import { paintCurves } from "./planecurves.js";
import { paintGround, paintLoop } from "./planemarks.js";
import { smooth } from "./smooth.js";
import { evenly } from "./ticks.js";
import { mark, plain } from "./words.js";
import { scaled, shifted } from "./zoom.js";

/** @import { Bode } from "./bode.js" */
/** @import { Chart, Range } from "./chart.js" */
/** @import { Curve } from "./curves.js" */
/** @import { Curves } from "./messages.js" */
/** @typedef {"nyquist" | "nichols"} PlaneKind */
/** @typedef {[x: Range, y: Range]} Box */
/** `path`: what is drawn through the points; null where nothing is known between them. @typedef {{name: Curves, curve: Curve, x: Float64Array, y: Float64Array, db: number[], deg: number[], path: import("./smooth.js").Path | null}} Traced */

const LEFT = 52,
  BELOW = 26,
  LABEL = 18,
  TOP = 8,
  RIGHT = 10,
  BOTTOM = 2;
const STEP = 0.7,
  TICK_PX = 62,
  NEAR = /** @type {Record<PlaneKind, Box>} */ ({
    nyquist: [
      [-2.5, 0.5],
      [-1.5, 1.5],
    ],
    nichols: [
      [-270, -90],
      [-20, 20],
    ],
  });

/** @param {string} text @returns {Box | null} */
function boxOf(text) {
  const [a, b, c, d] = text.split("_").map(Number);
  return a < b && c < d && [a, b, c, d].every(Number.isFinite)
    ? [
        [a, b],
        [c, d],
      ]
    : null;
}

export class Plane {
  /**
   * @param {Bode} bode
   * @param {HTMLElement} host
   * @param {PlaneKind} kind
   */
  constructor(bode, host, kind) {
    this.bode = bode;
    this.host = host;
    this.kind = kind;
    /** What a person has chosen to see; null: all of the curves. */
    this.sight = boxOf(chosen(`${kind}-box`, ""));
    /** @type {Box | null} */
    this.kept = null;
    /** @type {Traced[]} */
    this.traced = [];
    this.of = "";
  }

  /** @returns {Chart | undefined} */
  get made() {
    return this.bode.charts[0];
  }

  get round() {
    return this.kind === "nyquist";
  }

  get title() {
    return this.round ? tr("Nyquist plot") : tr("Nichols chart");
  }

  /** Whether the curves are the open loop, so that −1 and the contours have a meaning. */
  get loop() {
    return ofLoop(this.bode);
  }

  /** @returns {Chart} */
  build() {
    const { bode, round } = this,
      { of: shown } = bode.zooming;
    // What was chosen to see belongs to one axis and quantity.
    if (this.of && this.of !== shown) this.see(null);
    this.of = shown;
    const size = { size: LEFT, labelSize: LABEL };
    const unit = bode.units[bode.view.power + 2] ?? "",
      of = unit && !this.loop ? ` (${unit})` : "";
    const [across, up] = round
      ? [tr("real part") + of, tr("imaginary part") + of]
      : [tr("phase in °"), tr("magnitude in dB")];
    /** @type {Extract<uPlot.Axis.Splits, Function>} */
    const even = (u, i, low, high) =>
      evenly(low, high, (i ? u.bbox.height : u.bbox.width) / devicePixelRatio / TICK_PX);
    const words = (/** @type {Chart} */ _u, /** @type {number[]} */ s) =>
      s.map((v) => (round ? plain(v, 3).replace("-", "−") : mark(v)));
    const own = { splits: even, values: words, filter: (/** @type {Chart} */ _u, /** @type {number[]} */ s) => s };
    const made = chart(
      this.host,
      {
        scales: {
          x: { time: false, range: (u) => this.ranges(u)[0] },
          y: { range: (u) => this.ranges(u)[1] },
        },
        padding: [TOP, RIGHT, BOTTOM, 0],
        axes: [
          axis(across, { ...own, size: BELOW, labelSize: LABEL, ...(round ? {} : { splits: degrees }) }),
          axis(up, { ...own, ...size }),
        ],
        series: [{}, { label: "plane", stroke: "transparent", points: { show: false } }],
        cursor: {
          x: false,
          y: false,
          points: { show: false },
          drag: { x: false, y: false, setScale: false },
          bind: { dblclick: () => () => null },
        },
        hooks: {
          ready: [(u) => gestures(u, this.actions(u))],
          setCursor: [(u) => this.follow(u)],
          draw: [(u) => this.paint(u)],
        },
      },
      this.data(),
    );
    // The scales depend on the size: another size needs other ranges.
    const resize = made.setSize.bind(made);
    made.setSize = (to) =>
      made.batch(() => {
        resize(to);
        made.setData(made.data);
      });
    return made;
  }

  // uPlot needs data; the curves are drawn by `paint`, because they go back and forth along both axes.
  /** @returns {[number[], number[]]} */
  data() {
    const { bode, round } = this,
      modelled = bode.laid.includes("model") && bode.shown.has("model") && Boolean(bode.drawn.model);
    this.traced = bode.laid.flatMap((name) => {
      const curve = bode.curves[name],
        drawn = bode.drawn[name];
      if (!curve || !drawn || !bode.shown.has(name)) return [];
      /** @type {(values: import("./curves.js").Values, by: number) => number[]} */
      const pick = (values, by) => curve.index.map((at) => (values[at] ?? NaN) + by);
      const [db, deg] = [pick(drawn.db, 0), pick(drawn.deg, drawn.turns)];
      const size = db.map((v) => 10 ** (v / 20)),
        turn = Math.PI / 180;
      const x = Float64Array.from(deg, (v, i) => (round ? size[i] * Math.cos(v * turn) : v)),
        y = Float64Array.from(deg, (v, i) => (round ? size[i] * Math.sin(v * turn) : db[i]));
      // Between the lines of a measurement only the model is known.
      const path =
        name === "model" ? smooth(curve.hz, db, deg, round) : modelled && name === "measured" ? null : { x, y };
      return [{ name, curve, x, y, db, deg, path }];
    });
    return [
      [0, 1],
      [0, 1],
    ];
  }

  /**
   * The visible ranges; of Nyquist with the same length of one unit on both axes.
   *
   * @param {Chart} u
   * @returns {Box}
   */
  ranges(u) {
    const box = this.sight ?? this.whole();
    if (!this.round) return box;
    const wide = Math.max(20, u.width - LEFT - LABEL - RIGHT),
      high = Math.max(20, u.height - BELOW - LABEL - TOP - BOTTOM);
    const unit = Math.max((box[0][1] - box[0][0]) / wide, (box[1][1] - box[1][0]) / high);
    const [x, y] = box.map(([low, top]) => (low + top) / 2);
    return [
      [x - (unit * wide) / 2, x + (unit * wide) / 2],
      [y - (unit * high) / 2, y + (unit * high) / 2],
    ];
  }

  /** All values that can be distinguished from zero, and the critical point. It does not follow noise. @returns {Box} */
  whole() {
    const found = [0, 1].map((k) => {
      /** @type {number[]} */
      const all = this.loop ? (this.round ? [-1, 0] : [k ? 0 : -180]) : this.round ? [0] : [];
      if (this.round && k === 1) all.push(0);
      for (const { curve, x, y } of this.traced)
        for (const [i, v] of (k ? y : x).entries()) if (Number.isFinite(v) && !(curve.reach[i] >= 1)) all.push(v);
      return all.length ? [Math.min(...all), Math.max(...all)] : [-1, 1];
    });
    const wanted = /** @type {Box} */ (
      found.map(([low, high]) => {
        const span = Math.max(high - low, this.round ? 1e-9 : 1),
          step = evenly(0, span, 10)[1] ?? span;
        return [Math.floor((low - span * 0.06) / step) * step, Math.ceil((high + span * 0.06) / step) * step];
      })
    );
    const { kept } = this;
    const steady = kept?.every(
      ([low, high], k) => low <= found[k][0] && high >= found[k][1] && wanted[k][1] - wanted[k][0] > 0.6 * (high - low),
    );
    if (!steady || !kept) this.kept = wanted;
    return this.kept ?? wanted;
  }

  /** @param {Box | null} box */
  see(box) {
    if (box?.some(([low, high]) => !(high - low > 1e-9 * Math.max(1e-6, Math.abs(low), Math.abs(high))))) return;
    this.sight = box;
    const text = box ? box.flat().map((v) => String(Number(v.toPrecision(6)))) : [];
    remember(`${this.kind}-box`, text.join("_"), "");
    this.made?.setData(this.data());
  }

  /** The neighbourhood of the critical point. */
  near() {
    this.see(NEAR[this.kind]);
  }

  /** @returns {Box} */
  get box() {
    const { x, y } = this.made?.scales ?? {};
    return [
      [x?.min ?? 0, x?.max ?? 1],
      [y?.min ?? 0, y?.max ?? 1],
    ];
  }

  /** Zoom around the line under the cursor. @param {boolean} closer */
  magnify(closer) {
    const own = this.own(),
      { line } = this.bode;
    const at = this.box.map(([low, high], k) => {
      const v = own ? (k ? own.y : own.x)[line] : NaN;
      return v > low && v < high ? v : (low + high) / 2;
    });
    const factor = closer ? STEP : 1 / STEP;
    this.see(/** @type {Box} */ (this.box.map((range, k) => scaled(range, at[k], factor, false))));
  }

  /** @param {number} x @param {number} y in shares of the chart */
  shift(x, y) {
    this.see([shifted(this.box[0], x, false), shifted(this.box[1], y, false)]);
  }

  /** The curve with the cursor. */
  own() {
    return this.traced.find(({ name }) => name === this.bode.main);
  }

  /** The line nearest to the pointer gets the cursor. @param {Chart} u */
  follow(u) {
    const { left = -1, top = -1 } = u.cursor,
      { bode } = this,
      own = this.own();
    if (left < 0 || !own) {
      bode.tooltip.hide();
      return;
    }
    let best = -1,
      least = Infinity;
    for (const [i, x] of own.x.entries()) {
      const away = Math.hypot(u.valToPos(x, "x") - left, u.valToPos(own.y[i], "y") - top);
      if (away < least) [best, least] = [i, away];
    }
    if (best < 0) return;
    bode.go(own.curve.hz[best]);
    if (u.over.matches(":hover")) bode.tooltip.show(u, bode.lines[bode.line], bode.valuesAt(bode.line), bode.view);
  }

  /** @param {Chart} u @returns {import("./gestures.js").Gestures} */
  actions(u) {
    const across = (/** @type {number} */ share) => u.posToVal(share * u.over.clientWidth, "x"),
      up = (/** @type {number} */ share) => u.posToVal(share * u.over.clientHeight, "y");
    return {
      scale: (x, y, factorX, factorY) => {
        const both = factorX === 1 ? factorY : factorY === 1 ? factorX : Math.sqrt(factorX * factorY);
        const [fx, fy] = this.round ? [both, both] : [factorX, factorY];
        this.see([scaled(this.box[0], across(x), fx, false), scaled(this.box[1], up(y), fy, false)]);
      },
      shift: (x, y) => this.shift(x, y),
      box: (x, y) => {
        const [wide, high] = this.box;
        this.see([x ? [across(x[0]), across(x[1])] : wide, y ? [up(y[1]), up(y[0])] : high]);
      },
      place: (second) => this.bode.place(second),
      reset: () => {
        this.bode.cursors.undo();
        this.see(null);
        this.bode.tell();
      },
    };
  }

  /** @param {Chart} u */
  paint(u) {
    const { ctx, bbox } = u,
      /** @type {import("./planemarks.js").Sheet} */
      sheet = { ctx, px: devicePixelRatio, u, plane: this, bode: this.bode, taken: [] };
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    if (this.loop) paintGround(sheet);
    paintCurves(sheet);
    if (this.loop) paintLoop(sheet);
    ctx.restore();
  }
}

/** @type {Extract<uPlot.Axis.Splits, Function>} */
function degrees(u, i, low, high) {
  const room = u.bbox.width / devicePixelRatio / TICK_PX,
    step = [5, 10, 15, 30, 45, 90, 180, 360].find((s) => (high - low) / s < room);
  if (!step || high - low < 15) return step ? evenly(low, high, room) : degreeTicks(u, i, low, high);
  return Array.from(
    { length: Math.floor(high / step) - Math.ceil(low / step) + 1 },
    (_, n) => step * (Math.ceil(low / step) + n),
  );
}
