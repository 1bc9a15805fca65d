// Magnitude, phase and coherence over logarithmic frequency: measured with its band, reference, baseline, model.
import { axis, chart, degreeTicks, frequencyAxis, steady } from "./chart.js";
import { NAMES, extent, moved, overGrid, turns } from "./curves.js";
import { byFinger } from "./finger.js";
import { colour } from "./theme.js";

const FEW_LINES = 40;
const DASHES = { measured: [], reference: [8, 4], baseline: [2, 3], model: [5, 2] };

export class Bode {
  constructor(hosts, onCursor) {
    Object.assign(this, { hosts, onCursor });
    this.shown = new Set(NAMES);
    this.curves = {};
    this.charts = [];
    this.line = 0;
  }

  // Start again with these lines.
  begin(facts, unit, symbol) {
    this.clear();
    this.lines = facts.frequency_hz;
    this.grid = facts.grid_hz;
    this.at = this.lines.map((f) =>
      this.grid.reduce((best, g, i) => (Math.abs(g - f) < Math.abs(this.grid[best] - f) ? i : best), 0),
    );
    this.line = Math.min(this.line, this.lines.length - 1);
    this.ranges = [steady({ step: 5, least: 10 }), steady({ step: 15, least: 30 })];
    const pad = (this.grid.at(-1) / this.grid[0]) ** 0.03 || 1.1;
    this.whole = [this.grid[0] / Math.max(pad, 1.02), this.grid.at(-1) * Math.max(pad, 1.02)];
    this.sight = this.whole;
    this.charts = [
      this.panel(0, `|${symbol}| in dB${unit ? ` re 1 ${unit}` : ""}`, { range: () => this.limits(0) }, false),
      this.panel(1, "phase in °", { range: () => this.limits(1) }, false, { splits: degreeTicks }),
      this.panel(2, "coherence", { range: [-0.05, 1.08] }, true, { splits: () => [0, 0.5, 1] }),
    ];
  }

  // Show nothing until the next `begin`.
  clear() {
    for (const made of this.charts) made.destroy();
    this.charts = [];
    this.curves = {};
  }

  panel(index, label, y, last, more = {}) {
    const lines = () => this.lines;
    const few = this.lines.length <= FEW_LINES;
    const series = [{ label: "frequency" }],
      bands = [];
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
          frequencyAxis(lines, last ? "frequency in Hz" : ""),
          axis(label, { size: 44, values: (_u, s) => s.map((v) => String(v).replace("-", "−")), ...more }),
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

  data(index) {
    const key = ["db", "deg", "coherence"][index],
      found = [this.grid];
    const nothing = (this.nothing ||= new Array(1).fill(null));
    const empty =
      nothing.length === this.grid.length ? nothing : (this.nothing = new Array(this.grid.length).fill(null));
    for (const name of NAMES) {
      const curve = this.curves[name],
        by = index === 1 ? curve?.turns || 0 : 0;
      found.push(curve ? moved(curve[key], by) : empty);
      if (index < 2 && name !== "model")
        for (const edge of ["High", "Low"]) found.push(curve ? moved(curve[key + edge], by) : empty);
    }
    return found;
  }

  limits(index) {
    const key = ["db", "deg"][index];
    const drawn = NAMES.filter((n) => this.shown.has(n) && this.curves[n]).map((n) => this.curves[n]);
    const by = (curve, values) => moved(values, index ? curve.turns : 0);
    const sure = drawn.map((curve) => by(curve, curve[`${key}Sure`]));
    const known = sure.some((values) => values.some(Number.isFinite));
    const edges = drawn.flatMap((curve) => [`${key}High`, `${key}Low`].map((edge) => by(curve, curve[edge])));
    const all = drawn.map((curve) => by(curve, curve[key]));
    // A measured point is always in the picture; only its band may leave it.
    const points = drawn.flatMap((curve, i) => (curve === this.curves.measured ? [all[i]] : []));
    return this.ranges[index](...extent(known ? [...sure, ...points] : all, [...edges, ...all], index ? 10 : 3));
  }

  // A frame of a curve; drawn at the next `draw`.
  take(frame) {
    const name = frame.kind === "newest" || frame.kind === "moment" ? "measured" : frame.kind;
    this.curves[name] = overGrid(frame, this.grid, this.at);
  }

  drop(name) {
    delete this.curves[name];
  }

  draw() {
    const measured = this.curves.measured;
    for (const name of NAMES) {
      const curve = this.curves[name];
      if (curve) curve.turns = name === "measured" || !measured ? 0 : turns(curve, measured);
    }
    this.charts.forEach((made, index) => made.setData(this.data(index)));
    this.tell();
  }

  toggle(name, show) {
    if (show) this.shown.add(name);
    else this.shown.delete(name);
    this.charts.forEach((made, index) => {
      made.series.forEach((s, i) => {
        if (i && s.label.split(" ")[0] === name && s.show !== show) made.setSeries(i, { show });
      });
    });
    this.draw();
  }

  zoom(sight) {
    this.sight = sight;
    for (const made of this.charts) made.setData(made.data);
  }

  select(u) {
    const { left, width } = u.select;
    if (width > 8) this.zoom([u.posToVal(left, "x"), u.posToVal(left + width, "x")]);
    u.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
  }

  follow(u) {
    const { left } = u.cursor;
    if (left === undefined || left < 0 || this.placing) return;
    const f = u.posToVal(left, "x");
    this.line = this.lines.reduce(
      (best, g, i) => (Math.abs(Math.log(g / f)) < Math.abs(Math.log(this.lines[best] / f)) ? i : best),
      0,
    );
    this.tell();
    this.ring();
  }

  // The next or the previous line under the cursor.
  step(by) {
    if (!this.charts.length) return;
    this.line = Math.min(this.lines.length - 1, Math.max(0, this.line + by));
    this.tell();
    this.ring();
  }

  ring() {
    for (const made of this.charts) made.redraw(false, false);
  }

  // A ring around each curve's value at the line under the cursor.
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
    if (Number.isFinite(value) && this.shown.has("measured")) {
      ctx.strokeStyle = colour("ink");
      ctx.beginPath();
      ctx.arc(x, u.valToPos(value, "y", true), 6.5 * devicePixelRatio, 0, 7);
      ctx.stroke();
    }
    ctx.restore();
  }

  tell() {
    const at = this.at[this.line],
      found = {};
    for (const name of NAMES) {
      const curve = this.curves[name];
      if (!curve || !this.shown.has(name)) continue;
      const i = curve.frame.columns === this.grid.length && name === "model" ? at : this.line;
      found[name] = {
        db: curve.frame.magnitude[i],
        deg: curve.frame.phase[i] + (curve.turns || 0),
        reach: curve.frame.reach[i],
        coherence: curve.frame.coherence[i],
        frame: curve.frame,
      };
    }
    this.onCursor(this.lines[this.line], found);
  }
}
