// @ts-check
// The margins of the loop with their bounds; small ones are marked.
import { tr } from "./language.js";
import { element } from "./make.js";
import { Series } from "./series.js";
import { bounded } from "./trends.js";
import { worded } from "./worded.js";
import { hertz, pair, plain } from "./words.js";

/** @import { AtLines, Trend } from "./messages.js" */

/**
 * Usual limits of a servo loop: 6 dB, 30°, Ms 2. Worse values are marked, with a word.
 *
 * @type {[name: string, words: string, small: (v: number) => boolean][]}
 */
const ROWS = [
  ["gain_margin", tr("gain may rise by"), (v) => v < 6],
  ["gain_reduction", tr("gain may fall by"), (v) => Math.abs(v) < 6],
  ["phase_margin", tr("phase margin"), (v) => Math.abs(v) < 30],
  ["delay_margin", tr("delay margin"), () => false],
  ["peak_sensitivity", tr("peak sensitivity Ms"), (v) => v > 2],
  ["bandwidth", tr("bandwidth"), () => false],
];

/** @param {{model: string, name: string}} trend */
export const isMargin = ({ model, name }) => model === "margins" && ROWS.some(([known]) => known === name);
/** @param {string} name */
export const marginWords = (name) => ROWS.find(([known]) => known === name)?.[1] ?? name;

export class Margins {
  /** @param {HTMLElement} host */
  constructor(host) {
    this.host = host;
    /** @type {Map<string, Series>} */
    this.items = new Map();
    /** @type {AtLines | null} */
    this.lines = null;
    this.why = "";
  }

  /**
   * @param {Trend[]} list
   * @param {string} why there may be none
   */
  begin(list, why) {
    this.items.clear();
    this.why = why;
    for (const trend of list) this.take(trend);
    this.draw();
  }

  /** @param {Trend} trend */
  take(trend) {
    if (trend.model !== "margins") return;
    const series = this.items.get(trend.name) ?? new Series(trend);
    this.items.set(trend.name, series);
    series.take(trend);
  }

  // The margins at a time, or the newest.
  draw(atS = NaN) {
    const { lines, items } = this,
      rows = [];
    for (const [name, words, small] of ROWS) {
      const found = items.get(name);
      if (!found?.t.length) continue;
      const row = found.at(atS),
        beside = items.get(`${name}_frequency`);
      const at = beside ? beside.v[beside.at(atS)] : NaN,
        value = found.v[row];
      const none = found.status[row] === "none",
        mark = !none && small(value);
      rows.push(
        element(
          "tr",
          { "data-name": name },
          element("th", { scope: "row" }, words),
          element(
            "td",
            { class: mark ? "small" : "" },
            none ? tr("no limit") : `${bounded(value, found.s[row], found.unit)}${mark ? ` ⚠ ${tr("small")}` : ""}`,
          ),
          element("td", {}, Number.isFinite(at) ? `${plain(at, 3)} Hz` : ""),
          element("td", {}, none ? tr("no crossing") : worded(found.status[row])),
        ),
      );
    }
    // It belongs to the newest response, so it is not shown for a time in the past.
    if (lines && !Number.isFinite(atS))
      rows.push(
        element(
          "tr",
          { "data-name": "at_lines" },
          element("th", { scope: "row" }, tr("largest |S| at a line")),
          element(
            "td",
            { class: lines.value > 2 ? "small" : "" },
            `${pair(lines.value, lines.bound)}${lines.value > 2 ? ` ⚠ ${tr("large")}` : ""}`,
          ),
          element("td", {}, `${hertz(lines.frequency_hz)} Hz`),
          element("td", {}, tr("measured, without a model")),
        ),
      );
    if (!rows.length) {
      this.host.replaceChildren(element("p", { class: "empty" }, this.why));
      return;
    }
    const titles = [tr("margin"), tr("value, ± 95 % if the model is complete"), tr("at"), tr("source")];
    const head = titles.map((t) => element("th", { scope: "col" }, t));
    this.host.replaceChildren(
      element(
        "table",
        { class: "margins" },
        element("thead", {}, element("tr", {}, ...head)),
        element("tbody", {}, ...rows),
      ),
    );
  }
}
