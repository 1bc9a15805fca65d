// @ts-check
// Where each tile is: axes in groups, one below the other, each with a heading and rows of tiles.

/** @typedef {{from: number, to: number, name: string, y: number, height: number}} Group `from`, `to` in the list of shown axes */
/** @typedef {{width: number, height: number, gap: number, words: boolean}} Size of a tile */
/** @typedef {{groups: Group[], columns: number, height: number, step: number, rise: number}} Plan */

export const HEAD = 26,
  BELOW = 12,
  EDGE = 4;

/** @type {Record<string, Size>} */
export const SIZES = {
  small: { width: 14, height: 14, gap: 2, words: false },
  medium: { width: 26, height: 26, gap: 3, words: false },
  large: { width: 172, height: 30, gap: 5, words: true },
};

/**
 * The first levels of a path; never all, so that axes of one machine are a group.
 *
 * @param {string} path
 * @param {number} levels
 */
export function prefix(path, levels) {
  let cut = 0;
  for (let level = 0; level < levels; level++) {
    const next = path.indexOf("/", cut ? cut + 1 : 0);
    if (next < 0) break;
    cut = next;
  }
  return path.slice(0, cut);
}

/**
 * @param {ArrayLike<number>} shown numbers of axes, in order
 * @param {string[]} paths of all axes
 * @param {number} levels by which they are grouped
 * @param {number} width of the host
 * @param {Size} size
 * @returns {Plan}
 */
export function arrange(shown, paths, levels, width, size) {
  const step = size.width + size.gap,
    rise = size.height + size.gap;
  const columns = Math.max(1, Math.floor((width - 2 * EDGE + size.gap) / step));
  /** @type {Group[]} */
  const groups = [];
  let at = 0,
    y = 0;
  while (at < shown.length) {
    const path = prefix(paths[shown[at]], levels);
    const from = at;
    const inside = `${path}/`;
    while (at < shown.length && (path ? paths[shown[at]].startsWith(inside) : prefix(paths[shown[at]], levels) === ""))
      at++;
    const height = HEAD + Math.ceil((at - from) / columns) * rise + BELOW;
    groups.push({ from, to: at, name: path.slice(path.lastIndexOf("/") + 1), y, height });
    y += height;
  }
  return { groups, columns, height: y, step, rise };
}

/**
 * The group at a height; the last one below all.
 *
 * @param {Group[]} groups
 * @param {number} y
 */
export function groupAt(groups, y) {
  let low = 0,
    high = groups.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (groups[middle].y <= y) low = middle;
    else high = middle - 1;
  }
  return low;
}

/**
 * The place of the tile that a key leads to, from that of another one.
 *
 * @param {Plan} plan
 * @param {number} at
 * @param {string} key
 * @param {number} rows in a page
 * @returns {number | null} null if the key does not move
 */
export function moved({ groups, columns }, at, key, rows) {
  const last = (groups.at(-1)?.to ?? 0) - 1;
  /** @param {number} way */
  const line = (way) => {
    const g = groups.findIndex(({ to }) => at < to),
      { from, to } = groups[g],
      column = (at - from) % columns;
    const next = at + way * columns;
    if (next >= from && next < to) return next;
    if (way > 0 && at - from < Math.floor((to - from - 1) / columns) * columns) return to - 1;
    const other = groups[g + way];
    if (!other) return at;
    const count = other.to - other.from;
    const start = way > 0 ? 0 : Math.floor((count - 1) / columns) * columns;
    return other.from + Math.min(count - 1, start + column);
  };
  /** @type {Record<string, () => number>} */
  const moves = {
    ArrowRight: () => at + 1,
    ArrowLeft: () => at - 1,
    ArrowDown: () => line(1),
    ArrowUp: () => line(-1),
    PageDown: () => at + rows * columns,
    PageUp: () => at - rows * columns,
    Home: () => 0,
    End: () => last,
  };
  return moves[key] ? Math.max(0, Math.min(last, moves[key]())) : null;
}
