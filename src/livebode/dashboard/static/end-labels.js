// @ts-check
// The frequency of each line beside its newest point: ten lines cannot be told apart by their colours alone.

/** @import { Chart } from "./chart.js" */
/** @typedef {{text: string, ink: string, y: number}} Label */

const APART_PX = 11;

/**
 * Move labels apart, within a chart, in the order of their places.
 *
 * @param {number[]} places ascending, px
 * @param {number} top
 * @param {number} bottom
 * @param {number} apart
 */
export function spread(places, top, bottom, apart) {
  const found = [...places];
  for (const i of found.keys()) found[i] = Math.max(found[i], i ? found[i - 1] + apart : top);
  for (let i = found.length - 1; i >= 0; i--)
    found[i] = Math.min(found[i], i < found.length - 1 ? found[i + 1] - apart : bottom);
  return found;
}

/**
 * @param {Chart} u
 * @param {{text: string, ink: string}[]} lines
 * @param {number} stride series of each line
 */
export function endLabels(u, lines, stride) {
  const { ctx, bbox, scales } = u,
    ratio = devicePixelRatio;
  /** @type {Label[]} */
  const labels = [];
  for (const [i, { text, ink }] of lines.entries()) {
    const values = u.data[1 + i * stride] ?? [];
    let last = values.length - 1;
    while (last >= 0 && (values[last] == null || u.data[0][last] > (scales.x.max ?? Infinity))) last--;
    if (last >= 0) labels.push({ text, ink, y: u.valToPos(values[last] ?? 0, "y", true) });
  }
  labels.sort((a, b) => a.y - b.y);
  const places = spread(
    labels.map(({ y }) => y),
    bbox.top,
    bbox.top + bbox.height,
    APART_PX * ratio,
  );
  ctx.save();
  ctx.font = `${11 * ratio}px system-ui, "DejaVu Sans", sans-serif`;
  ctx.textAlign = "left";
  ctx.textBaseline = "middle";
  for (const [i, { text, ink }] of labels.entries()) {
    ctx.fillStyle = ink;
    ctx.fillText(text, bbox.left + bbox.width + 4 * ratio, places[i]);
  }
  ctx.restore();
}
