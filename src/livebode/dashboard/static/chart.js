// @ts-check
// Common parts of the charts: colours, letters, ticks, and ranges that do not jump.
import uPlot from "/static/uplot/uPlot.esm.js";
import { colour, onTheme } from "./theme.js";

/** @typedef {uPlot} Chart */
/** @typedef {[low: number, high: number]} Range */

const COLUMN_PX = 50,
  ROW_PX = 30; // between marks
const WALL_PX = 768; // of the window's width for each unit of scale: letters of 30 px on 1,920 px

/** Size of letters and of their room; larger in the wall mode. */
export const letters = () => (document.body.classList.contains("wall") ? Math.max(1, innerWidth / WALL_PX) : 1);
/** @type {Set<Chart>} */
const charts = new Set();
onTheme(() => {
  for (const chart of charts) chart.redraw(false, true);
});

/**
 * @param {uPlot.Axis.Label} label
 * @param {uPlot.Axis} more
 * @returns {uPlot.Axis}
 */
export function axis(label, more = {}) {
  const scale = letters(),
    font = `${12 * scale}px system-ui, "DejaVu Sans", sans-serif`;
  return {
    label,
    labelFont: font,
    font,
    labelSize: label ? 18 * scale : 0,
    labelGap: 2,
    gap: 4,
    size: 46 * scale,
    space: (_u, at) => (at ? ROW_PX : COLUMN_PX) * scale,
    stroke: () => colour("muted"),
    grid: { stroke: () => colour("grid"), width: 1 },
    ticks: { stroke: () => colour("edge"), width: 1, size: 4 },
    ...more,
  };
}

/**
 * The label of an upright axis: the first of these texts that is not longer than the chart is high, else the last one.
 *
 * @param {string[]} texts
 * @returns {(u: uPlot) => string}
 */
export const fitting = (texts) => (u) => {
  const { ctx, bbox } = u,
    middle = bbox.top + bbox.height / 2, // of the axis, where the label is
    room = 2 * Math.min(middle, ctx.canvas.height - middle);
  return texts.find((text) => ctx.measureText(text).width <= room) ?? texts[texts.length - 1];
};

/**
 * Round frequencies on a logarithmic axis: the lines themselves if they are few, otherwise 1, 2, 5 of every decade.
 *
 * @param {() => number[]} lines
 * @returns {Extract<uPlot.Axis.Splits, Function>}
 */
export function frequencyTicks(lines) {
  return (u, _axis, low, high) => {
    const inside = lines().filter((f) => f >= low && f <= high);
    const room = u.bbox.width / devicePixelRatio / (46 * letters());
    const apart = inside.every((f, i) => i === 0 || Math.log(f / inside[i - 1]) / Math.log(high / low) > 1 / room);
    if (inside.length && inside.length <= Math.min(12, room) && apart) return inside;
    const found = [];
    const mantissas =
      high / low < 3 ? [1, 1.5, 2, 2.5, 3, 4, 5, 6, 7, 8, 9] : high / low < 30 ? [1, 2, 3, 5, 7] : [1, 2, 5];
    for (let d = Math.floor(Math.log10(low)); d <= Math.ceil(Math.log10(high)); d++)
      for (const m of mantissas) {
        const f = m * 10 ** d;
        if (f >= low && f <= high) found.push(f);
      }
    return found;
  };
}

/**
 * A range that grows immediately and shrinks after a delay, so that the picture is steady.
 *
 * @param {{step: number, least: number, holdMs?: number}} options
 * @returns {(low: number, high: number) => Range}
 */
export function steady({ step, least, holdMs = 2500 }) {
  /** @type {Range | null} */
  let kept = null;
  let since = 0;
  /** @type {(low: number, high: number) => Range} */
  const round = (low, high) => {
    const middle = (low + high) / 2,
      half = Math.max((high - low) * 0.54, least / 2);
    const s = half > 12 * step ? 2 * step : step;
    return [Math.floor((middle - half) / s) * s, Math.ceil((middle + half) / s) * s];
  };
  return (low, high) => {
    if (!(high >= low)) return kept || [-least / 2, least / 2];
    const wanted = round(low, high),
      now = performance.now();
    if (!kept || low < kept[0] || high > kept[1]) {
      kept = kept ? [Math.min(kept[0], wanted[0]), Math.max(kept[1], wanted[1])] : wanted;
      if (kept[1] - kept[0] > 1.7 * (wanted[1] - wanted[0])) kept = wanted;
      since = now;
    } else if (wanted[1] - wanted[0] > 0.7 * (kept[1] - kept[0])) since = now;
    else if (now - since > holdMs) {
      kept = wanted;
      since = now;
    }
    return kept;
  };
}

/**
 * Round multiples for degrees.
 *
 * @param {Chart} u
 * @param {number} _axis
 * @param {number} low
 * @param {number} high
 */
export function degreeTicks(u, _axis, low, high) {
  const step =
    [5, 10, 15, 30, 45, 90, 180, 360].find(
      (s) => ((high - low) / s) * 26 * letters() < u.bbox.height / devicePixelRatio,
    ) || 720;
  const found = [];
  for (let d = Math.ceil(low / step) * step; d <= high + 1e-9; d += step) found.push(d);
  return found;
}

/**
 * A chart in a host element that follows its size.
 *
 * @param {HTMLElement} host
 * @param {Omit<uPlot.Options, "width" | "height">} options
 * @param {uPlot.AlignedData} data
 * @returns {Chart}
 */
export function chart(host, options, data) {
  const size = () => ({ width: Math.max(60, host.clientWidth), height: Math.max(40, host.clientHeight) });
  const made = new uPlot(
    { ...size(), legend: { show: false }, padding: [8 * letters(), 10, 2, 0], pxAlign: 1, ...options },
    data,
    host,
  );
  const watching = new ResizeObserver(() => made.setSize(size()));
  watching.observe(host);
  charts.add(made);
  const destroy = made.destroy.bind(made);
  made.destroy = () => {
    charts.delete(made);
    watching.disconnect();
    destroy();
  };
  return made;
}
