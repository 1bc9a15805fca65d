// @ts-check
// One raw signal over time, or its spectrum with the excited lines and the detection lines.
import { axis, chart, frequencyTicks } from "./chart.js";
import { moment } from "./clock.js";
import { tr } from "./language.js";
import { element } from "./make.js";
import { highest, remark, resolution, span } from "./signal-words.js";
import { colour } from "./theme.js";
import { magnitudeAxis } from "./ticks.js";
import { timeAxis, timeLabel } from "./time-ticks.js";
import { frequency, level } from "./values.js";
import { hertz, plain } from "./words.js";

/** @import { Chart, Range } from "./chart.js" */
/** @import { Answer, Signal, Spectrum } from "./signal-answer.js" */
/** @import { View } from "./view.js" */
/** @typedef {{hz: number, value: number, excited: boolean}} LineMark */

// Amplitudes that are smaller than the largest by more than this are rounding.
const REACH_DB = 120,
  // A screen reader is not interrupted by each new second.
  DESCRIBED_MS = 3000,
  TICK_PX = 34;

export class SignalChart {
  /**
   * @param {HTMLElement} host
   * @param {string} name of the channel
   * @param {boolean} spectrum
   * @param {View} view units and scales of the Bode plot
   */
  constructor(host, name, spectrum, view) {
    this.spectrum = spectrum;
    this.view = view;
    this.unit = "";
    /** @type {Range} */
    this.span = [0, 1];
    /** @type {LineMark[]} */
    this.marks = [];
    /** @type {number[]} times of missing samples */
    this.missing = [];
    this.role = element("span", { class: "role" });
    this.remark = element("span", { class: "remark" });
    this.value = element("span", { class: "at" });
    this.plot = element("div", { class: "plot", role: "img", "aria-label": name });
    this.host = element(
      "div",
      { class: "signal", "data-name": name },
      element("h3", {}, element("b", {}, name), this.role, this.remark, this.value),
      this.plot,
    );
    host.append(this.host);
    this.described = -Infinity;
    /** @type {Chart | null} */
    this.made = null;
  }

  build() {
    const { spectrum, view } = this,
      ink = () => colour("measured"),
      thin = { points: { show: false }, width: 1.2, pxAlign: 0 };
    return chart(
      this.plot,
      {
        padding: [6, 18, 0, 0],
        cursor: { y: false, points: { show: true, size: 6 }, drag: { x: false, y: false, setScale: false } },
        scales: {
          x: {
            time: false,
            ...(spectrum && !view.linear ? { distr: 3, log: 10 } : {}),
            range: () => this.span,
          },
          y: { range: (_u, low, high) => this.reach(low, high) },
        },
        axes: [
          axis(() => (spectrum ? this.frequencyLabel() : timeLabel(...this.span)), {
            size: 24,
            labelSize: 15,
            ...(spectrum ? this.frequencyAxis() : timeAxis),
          }),
          spectrum ? magnitudeAxis(this.levelLabel, view) : this.valueAxis(),
        ],
        series: spectrum
          ? [
              {},
              { label: "high", stroke: ink, ...thin },
              { label: "low", stroke: () => "transparent", width: 0, points: { show: false } },
            ]
          : [{}, { label: "value", stroke: ink, ...thin }],
        bands: spectrum ? [{ series: [1, 2], fill: () => colour("band") }] : [],
        hooks: { draw: [(u) => this.paint(u)], setCursor: [(u) => this.read(u)] },
      },
      spectrum ? [[], [], []] : [[], []],
    );
  }

  /** @returns {Partial<uPlot.Axis>} */
  frequencyAxis() {
    /** @type {Pick<uPlot.Axis, "values">} */
    const marks = { values: (_u, splits) => splits.map(hertz) };
    return this.view.linear
      ? marks
      : { ...marks, splits: apart(frequencyTicks(() => [])), filter: (_u, splits) => splits };
  }

  frequencyLabel() {
    return this.view.perHz === 1 ? tr("frequency in Hz") : tr("angular frequency in rad/s");
  }

  get levelLabel() {
    const { unit } = this;
    return this.view.absolute || !unit ? unit : tr("dB re 1 {unit}", { unit });
  }

  valueAxis() {
    return axis(() => this.unit, { size: 54, space: 24, values: (_u, splits) => splits.map((v) => plain(v, 4)) });
  }

  /**
   * @param {number | null} low
   * @param {number | null} high
   * @returns {Range}
   */
  reach(low, high) {
    if (low === null || high === null) return [0, 1];
    const least = this.spectrum ? Math.max(low, high - REACH_DB) : low;
    const room = high > least ? 0.06 * (high - least) : Math.abs(high) / 10 || 1;
    return [least - room, high + room];
  }

  /**
   * @param {Answer} answer
   * @param {Signal & Spectrum} channel
   * @param {string} role
   */
  draw(answer, channel, role) {
    this.unit = channel.unit;
    this.role.textContent = [role, resolution(channel, this.view)].filter(Boolean).join(" · ");
    this.remark.textContent = remark(channel, this.spectrum);
    this.made ??= this.build();
    if (this.spectrum) this.drawSpectrum(answer, channel);
    else this.drawTime(answer, channel);
    this.describe(channel);
  }

  /** @param {Signal & Spectrum} channel */
  describe(channel) {
    const now = performance.now();
    if (now - this.described < DESCRIBED_MS) return;
    this.described = now;
    const { name } = channel,
      kind = this.spectrum ? tr("spectrum") : tr("over time"),
      extent = this.spectrum ? highest(channel, this.view) : span(channel);
    const words = [name, this.role.textContent, kind, this.remark.textContent, extent];
    this.plot.setAttribute("aria-label", words.filter(Boolean).join(", "));
  }

  /**
   * @param {Answer} answer
   * @param {Signal} channel
   */
  drawTime({ from_s: from, to_s: to, rate_hz: rate }, { at, value }) {
    this.span = [from, to];
    const x = Array.from(at, (n) => from + n / rate);
    this.missing = x.filter((_, i) => !Number.isFinite(value[i]));
    this.made?.setData([x, Array.from(value, (v) => (Number.isFinite(v) ? v : null))]);
  }

  /**
   * @param {Answer} answer
   * @param {Spectrum} channel
   */
  drawSpectrum({ lines_hz: lines, detection_hz: detection, rate_hz: rate }, channel) {
    const { perHz } = this.view,
      x = Array.from(channel.hz, (hz) => hz * perHz);
    this.span = [this.view.linear ? 0 : (x[0] ?? 1), (rate / 2) * perHz];
    const shown = (/** @type {number} */ v) => (v > 0 ? 20 * Math.log10(v) : null);
    /** @type {(values: number[] | undefined, hz: number[], excited: boolean) => LineMark[]} */
    const marks = (values, hz, excited) =>
      (values ?? []).map((v, i) => ({ hz: hz[i] * perHz, value: shown(v) ?? NaN, excited }));
    this.marks = [...marks(channel.detection, detection, false), ...marks(channel.lines, lines, true)];
    this.made?.setData([x, Array.from(channel.high, shown), Array.from(channel.low, shown)]);
  }

  /** @param {Chart} u */
  paint(u) {
    const { ctx, bbox } = u,
      px = devicePixelRatio;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.lineWidth = px;
    for (const { hz, value, excited } of this.spectrum ? this.marks : []) {
      const x = u.valToPos(hz, "x", true),
        y = u.valToPos(value, "y", true);
      ctx.beginPath();
      if (excited) {
        ctx.fillStyle = colour("model");
        ctx.arc(x, y, 3 * px, 0, 2 * Math.PI);
        ctx.fill();
      } else {
        ctx.strokeStyle = colour("muted");
        ctx.strokeRect(x - 2 * px, y - 2 * px, 4 * px, 4 * px);
      }
    }
    // A missing sample is narrower than a pixel: a line over the whole height.
    ctx.strokeStyle = colour("alarm");
    ctx.setLineDash([4 * px, 3 * px]);
    for (const timeS of this.spectrum ? [] : this.missing) {
      const x = u.valToPos(timeS, "x", true);
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + bbox.height);
      ctx.stroke();
    }
    ctx.restore();
  }

  /** @param {Chart} u */
  read(u) {
    const { idx } = u.cursor;
    if (idx === null || idx === undefined) {
      this.value.textContent = "";
      return;
    }
    const x = Number(u.data[0][idx]),
      v = u.data[1][idx] ?? NaN,
      { view, unit } = this;
    if (!this.spectrum) this.value.textContent = `${moment(x, true)} · ${plain(v)} ${unit}`;
    else
      this.value.textContent = `${frequency(x / view.perHz, view)} · ${level(v, view)}${view.absolute ? ` ${unit}` : ""}`;
  }

  remove() {
    this.made?.destroy();
    this.host.remove();
  }
}

/**
 * Marks with room for their words.
 *
 * @param {ReturnType<typeof frequencyTicks>} ticks
 * @returns {ReturnType<typeof frequencyTicks>}
 */
function apart(ticks) {
  return (u, index, low, high, ...more) => {
    let last = -Infinity;
    return ticks(u, index, low, high, ...more).filter((value) => {
      const x = u.valToPos(value, "x");
      if (x - last < TICK_PX) return false;
      last = x;
      return true;
    });
  };
}
