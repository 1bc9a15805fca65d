// @ts-check
// The tiles of the wall mode: one for each axis, the worst first. Where not all have room, the last one counts the rest.
import { tr } from "./language.js";
import { SIGNS } from "./look.js";
import { element } from "./make.js";

/** @import { Tone } from "./verdict.js" */
/** @typedef {{name: string, index: number, text: string, word: string, tone: Tone}} AxisTile `word` is short; `index` of the axis */

/** Height below which a plot with large letters is not readable, as a share of the window. */
const PLOT_SHARE = 0.3;

/**
 * @param {HTMLElement} host
 * @param {HTMLElement} list
 * @param {AxisTile[]} axes the worst first
 * @param {number | undefined} shown axis in the picture
 */
export function drawTiles(host, list, axes, shown) {
  const key = JSON.stringify([innerWidth, innerHeight, shown, axes]);
  if (list.dataset.key === key) return;
  list.dataset.key = key;
  list.hidden = axes.length < 2;
  const tall = () => host.getBoundingClientRect().height;
  list.replaceChildren(...axes.map((axis) => tile(axis, shown)));
  document.body.classList.toggle("crowded", tall() > (1 - PLOT_SHARE) * innerHeight);
  for (let count = axes.length - 1; count > 0 && tall() > innerHeight; count--)
    list.replaceChildren(...axes.slice(0, count).map((axis) => tile(axis, shown)), rest(axes.length - count));
}

/** @param {AxisTile} axis @param {number | undefined} shown */
const tile = ({ name, index, text, word, tone }, shown) =>
  element(
    "li",
    { class: tone, title: text, "aria-current": index === shown ? "true" : null },
    element("b", {}, `${SIGNS[tone]} ${name}`),
    element("span", {}, word),
  );

/** @param {number} count */
const rest = (count) => element("li", { class: "open" }, element("b", {}, tr("+{count} more", { count })));
