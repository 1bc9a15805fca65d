// @ts-check
// Points of many runs, sorted into one series for each quantity.

/** @import { RunRow } from "./runs_feed.js" */

/** @typedef {[model: string, name: string, unit: string, value: number, bound: number, low: number, high: number, timeS: number, unixS: number | null, fits: number]} SentPoint */
/** @typedef {[timeS: number, unixS: number | null, kind: string, message: import("./messages.js").Words]} SentAlarm */
/** @typedef {[model: string, name: string, at: number[], timeS: number[], value: number[], bound: number[]]} SentDetail */
/** @typedef {{points: SentPoint[], alarms: SentAlarm[], baseline: string | null}} RunTrend */
/** @typedef {{run: string, at: number, timeS: number, value: number, bound: number, low: number, high: number, written: boolean, message?: import("./messages.js").Words}} Point */
/** @typedef {{model: string, name: string, unit: string, points: Point[], shared?: boolean}} Quantity `shared`: by several models */
/** @typedef {{at: number, baseline: string, machine: string}} BaselineMark */

export const ALARMS = "alarms";

/**
 * When a run is shown: its own time of day, or else when it was written, if a person wants that.
 *
 * @param {RunRow} run
 * @param {number | null} unixS
 * @param {boolean} byWritten
 */
const placed = (run, unixS, byWritten) => unixS ?? (byWritten ? run.written : null);

/**
 * @param {RunRow[]} runs
 * @param {Map<string, RunTrend>} trends
 * @param {boolean} byWritten whether runs without a clock are shown at the time when they were written
 * @returns {{quantities: Quantity[], apart: RunRow[]}}
 */
export function quantitiesOf(runs, trends, byWritten) {
  /** @type {Map<string, Quantity>} */
  const found = new Map();
  /** @type {Quantity} */
  const counts = { model: "", name: ALARMS, unit: "", points: [] };
  const apart = [];
  for (const run of runs) {
    const trend = trends.get(run.name);
    if (!trend) continue;
    const begun = placed(run, run.begun, byWritten);
    if (begun === null) {
      apart.push(run);
      continue;
    }
    const written = run.begun === null;
    for (const [model, name, unit, value, bound, low, high, timeS, unixS] of trend.points) {
      const key = JSON.stringify([model, name, unit]);
      const quantity = found.get(key) ?? { model, name, unit, points: [] };
      found.set(key, quantity);
      const at = placed(run, unixS, byWritten) ?? begun;
      quantity.points.push({ run: run.name, at, timeS, value, bound, low, high, written });
    }
    const n = trend.alarms.length,
      newest = trend.alarms.at(-1);
    counts.points.push({
      run: run.name,
      at: placed(run, newest?.[1] ?? null, byWritten) ?? begun,
      timeS: newest?.[0] ?? 0,
      value: n,
      bound: 0,
      low: n,
      high: n,
      written,
      message: newest?.[3],
    });
  }
  for (const { points } of [...found.values(), counts]) points.sort((a, b) => a.at - b.at);
  const quantities = [...found.values()].sort((a, b) => rank(a) - rank(b) || a.name.localeCompare(b.name));
  for (const quantity of quantities)
    quantity.shared = quantities.some(({ name, model }) => name === quantity.name && model !== quantity.model);
  if (counts.points.length) quantities.unshift(counts);
  return { quantities, apart };
}

/**
 * Alarms first, then resonances, parameters, other derived quantities, margins.
 *
 * @param {Quantity} quantity
 */
function rank({ model, name }) {
  if (model === "margins") return 3;
  if (/^(anti)?resonance(_\d+)?$|frequency/.test(name)) return 0;
  return /damping|_q$|_ratio$/.test(name) ? 2 : 1;
}

/**
 * Where a run was compared with another baseline than the run of this machine before it.
 *
 * @param {RunRow[]} runs
 * @param {Map<string, RunTrend>} trends
 * @param {boolean} byWritten
 * @returns {BaselineMark[]}
 */
export function baselineMarks(runs, trends, byWritten) {
  /** @type {Map<string, string | null>} */
  const before = new Map();
  const marks = [];
  const placedRuns = runs.map((run) => ({ run, at: placed(run, run.begun, byWritten) ?? NaN }));
  for (const { run, at } of placedRuns.filter((one) => Number.isFinite(one.at)).sort((a, b) => a.at - b.at)) {
    const baseline = trends.get(run.name)?.baseline ?? null;
    if (baseline === null) continue;
    const known = before.get(run.machine);
    if (known !== undefined && known !== baseline) marks.push({ at, baseline, machine: run.machine });
    before.set(run.machine, baseline);
  }
  return marks;
}

/**
 * The range of the values with their usual bounds: one uncertain point does not hide the others.
 *
 * @param {Point[]} points
 * @returns {[low: number, high: number]}
 */
export function reach(points) {
  const bounds = points.map(({ bound }) => bound).sort((a, b) => a - b);
  const room = 2 * (bounds[bounds.length >> 1] ?? 0);
  let low = Infinity,
    high = -Infinity;
  for (const { value, bound } of points) {
    low = Math.min(low, value - Math.min(bound, room));
    high = Math.max(high, value + Math.min(bound, room));
  }
  if (!(high >= low)) return [0, 1];
  const least = Math.max(0.01 * Math.abs(low + high), 1e-12);
  const more = Math.max(0.08 * (high - low), (least - (high - low)) / 2);
  return [low - more, high + more];
}

/**
 * The point nearest to a time.
 *
 * @param {Point[]} points by time
 * @param {number} at
 */
export function nearest(points, at) {
  let best = points.length ? 0 : -1;
  for (const [i, point] of points.entries()) if (Math.abs(point.at - at) < Math.abs(points[best].at - at)) best = i;
  return best;
}
