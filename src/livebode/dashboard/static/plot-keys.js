// @ts-check
// What the mouse does on a chart or on the map, by keys while it has the focus.
import { scaled, shifted } from "./zoom.js";

/** @import { Bode } from "./bode.js" */
/** @import { Range } from "./chart.js" */
/** @import { Plane } from "./plane.js" */

const SHARE = 0.15,
  STEP = 0.7;

/** @param {KeyboardEvent} event */
const combined = (event) => event.ctrlKey || event.metaKey || event.altKey;

/** @type {Record<string, (range: Range, middle: number) => Range>} */
const HEIGHTS = {
  ArrowUp: (range) => shifted(range, SHARE, false),
  ArrowDown: (range) => shifted(range, -SHARE, false),
  PageUp: (range, middle) => scaled(range, middle, STEP, false),
  PageDown: (range, middle) => scaled(range, middle, 1 / STEP, false),
};

/** What moves or zooms the Nyquist plot and the Nichols chart. @type {Record<string, (plane: Plane) => void>} */
const PLANE = {
  ArrowUp: (plane) => plane.shift(0, SHARE),
  ArrowDown: (plane) => plane.shift(0, -SHARE),
  PageUp: (plane) => plane.magnify(true),
  PageDown: (plane) => plane.magnify(false),
};

/**
 * @param {Bode} bode
 * @param {HTMLElement} host of the Nyquist plot and the Nichols chart
 */
export function planeKeys(bode, host) {
  host.addEventListener("keydown", (event) => {
    const act = PLANE[event.key];
    if (!act || combined(event) || !bode.plane) return;
    event.preventDefault();
    act(bode.plane);
  });
}

/** The vertical axis of each chart of the Bode plot. @param {Bode} bode */
export function heightKeys(bode) {
  for (const [index, host] of bode.hosts.entries())
    host.addEventListener("keydown", (event) => {
      const next = HEIGHTS[event.key],
        { min, max } = bode.charts[index]?.scales.y ?? {};
      if (!next || combined(event) || typeof min !== "number" || typeof max !== "number") return;
      event.preventDefault();
      bode.zooming.along(index, next([min, max], (min + max) / 2));
      bode.zoomed();
    });
}

/** @type {Record<string, [columns: number, lines: number]>} */
const MOVES = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };

/** The cell of the map that is read. @param {import("./map.js").LineMap} map */
export function mapKeys(map) {
  let column = -1,
    line = 0;
  map.canvas.addEventListener("keydown", (event) => {
    const move = MOVES[event.key];
    if (!move || combined(event) || !map.cells) return;
    event.preventDefault();
    event.stopPropagation();
    column = Math.min(map.cells.columns - 1, Math.max(0, column + move[0]));
    line = Math.min(map.lines.length - 1, Math.max(0, line + move[1]));
    // Read out for a person who moves by keys; the mouse would make it speak without end.
    map.hover.setAttribute("aria-live", "polite");
    map.tell(column, line);
  });
  map.canvas.addEventListener("pointermove", () => map.hover.removeAttribute("aria-live"));
}
