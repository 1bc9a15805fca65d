// @ts-check
// The cells of the map: responses sorted by position or by time, each line with its level, change and coherence.

/** @import { History } from "./messages.js" */
/** @typedef {"level" | "change" | "coherence"} Shown */

/**
 * Values by column and line, and where the columns are: from `low` in steps, in s or in the unit of the schedule.
 *
 * @typedef {object} Cells
 * @property {number[][]} level
 * @property {(what: Shown) => number[][]} of the change is that from the median of all responses at the position
 * @property {number} low
 * @property {number} step
 * @property {number} columns
 * @property {boolean} moving over the position
 * @property {boolean} moved whether the position changes
 */
/**
 * Columns of equal width, each with its responses.
 *
 * @typedef {object} Columns
 * @property {number} low
 * @property {number} step
 * @property {number[][]} bins
 */

const PLACES = 56,
  // In a column over time; a column is then a few pixels wide.
  TIMES = 200,
  // Enough for a median.
  ROWS_IN_PLACE = 6,
  // A longer silence is a gap, as in the tracking plot.
  GAP_S = 2;

/** @param {number[]} values */
const middle = (values) => {
  values.sort((a, b) => a - b);
  const h = values.length >> 1;
  return values.length % 2 ? values[h] : (values[h - 1] + values[h]) / 2;
};

/** @param {number[]} values */
const mean = (values) => values.reduce((a, b) => a + b, 0) / values.length;

// The mean of the newest quarter.
const newest = (/** @type {number[]} */ values) => mean(values.slice(-Math.max(1, values.length >> 2)));

/**
 * @param {ArrayLike<number>} x of each row
 * @param {number[]} order rows with a known x
 * @param {number} columns
 * @returns {Columns}
 */
function columnsOf(x, order, columns) {
  let low = Infinity,
    high = -Infinity;
  for (const r of order) {
    low = Math.min(low, x[r]);
    high = Math.max(high, x[r]);
  }
  const step = (high - low) / columns || 1;
  /** @type {number[][]} */
  const bins = Array.from({ length: columns }, () => []);
  for (const r of order) bins[Math.min(columns - 1, Math.floor((x[r] - low) / step))].push(r);
  return { low, step, bins };
}

/**
 * Columns over time: one without a response has the last one before it, except in a gap. The newest responses are closer
 * together than those of the record, or further apart.
 *
 * @param {Columns} columns
 * @param {ArrayLike<number>} timeS of each row
 * @returns {Columns}
 */
function held({ low, step, bins }, timeS) {
  const filled = bins.filter((bin) => bin.length).length,
    gapS = Math.max(GAP_S, (5 * step * bins.length) / filled);
  for (let i = 1; i < bins.length; i++) {
    if (bins[i].length) continue;
    const last = bins[i - 1].at(-1),
      next = bins.slice(i).find((bin) => bin.length)?.[0];
    if (last !== undefined && next !== undefined && timeS[next] - timeS[last] <= gapS) bins[i] = [last];
  }
  return { low, step, bins };
}

const STILL = 1e-3; // of the position itself: noise of one place, or a machine that settles
/** @param {number[]} at positions */
function moves(at) {
  let low = Infinity,
    high = -Infinity;
  for (const v of at) {
    low = Math.min(low, v);
    high = Math.max(high, v);
  }
  return high - low > STILL * Math.max(high, -low);
}

/**
 * Sort the rows into cells; null without a valid response.
 *
 * @param {History} rows
 * @param {number[]} order their indices in order of arrival
 * @param {number} lines
 * @param {"position" | "time"} over the position only if it changes
 * @returns {Cells | null}
 */
export function sorted(rows, order, lines, over) {
  const positioned = order.filter((r) => Number.isFinite(rows.schedule[r])),
    placed = moves(positioned.map((r) => rows.schedule[r])) ? positioned : [],
    moving = over === "position" && placed.length > 0;
  const known = moving ? placed : order.filter((r) => Number.isFinite(rows.timeS[r]));
  if (!known.length) return null;
  const places = columnsOf(
    placed.length ? rows.schedule : rows.timeS,
    placed.length ? placed : known,
    placed.length ? Math.max(1, Math.min(PLACES, Math.ceil(placed.length / ROWS_IN_PLACE))) : 1,
  );
  const shown = moving ? places : held(columnsOf(rows.timeS, known, Math.min(TIMES, known.length)), rows.timeS);
  /** @type {(values: Float32Array, of: (values: number[]) => number) => (bin: number[]) => number[]} */
  const each = (values, of) => (bin) =>
    Array.from({ length: lines }, (_, line) => {
      const found = bin.map((r) => values[r * rows.columns + line]).filter(Number.isFinite);
      return found.length ? of(found) : NaN;
    });
  const level = shown.bins.map(each(rows.magnitude, moving ? newest : mean));
  if (!level.flat().some(Number.isFinite)) return null;
  const of = {
    level: () => level,
    change: once(() => {
      const usual = places.bins.map(each(rows.magnitude, middle));
      return shown.bins.map(each(change(rows, places.bins, usual, lines), moving ? newest : mean));
    }),
    coherence: once(() => shown.bins.map(each(rows.coherence, moving ? newest : mean))),
  };
  const { low, step, bins } = shown;
  return { level, of: (what) => of[what](), low, step, columns: bins.length, moving, moved: placed.length > 0 };
}

/**
 * @template T
 * @param {() => T} make called when it is first used
 */
function once(make) {
  /** @type {T | undefined} */
  let made;
  return () => {
    made ??= make();
    return made;
  };
}

/**
 * The change of each response from what is usual at its place.
 *
 * @param {History} rows
 * @param {number[][]} bins rows of each place
 * @param {number[][]} usual level of each place and line
 * @param {number} lines
 */
function change(rows, bins, usual, lines) {
  const found = new Float32Array(rows.magnitude.length).fill(NaN);
  for (const [place, bin] of bins.entries())
    for (const r of bin)
      for (let line = 0; line < lines; line++) {
        const at = r * rows.columns + line;
        found[at] = rows.magnitude[at] - usual[place][line];
      }
  return found;
}
