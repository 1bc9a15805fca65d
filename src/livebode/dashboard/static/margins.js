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
   * @param {string} why there may be none
   */
  begin(why) {
    this.why = why;
    this.draw();
  }

  // Show nothing until the next fit.
  clear() {
    this.items.clear();
    this.lines = null;
  }

  /** The margins with the fit that is drawn. @param {Trend[]} list one row of each parameter */
  show(list) {
    this.items.clear();
    for (const trend of list) {
      if (trend.model !== "margins") continue;
      const series = new Series(trend);
      this.items.set(trend.name, series);
      series.show(trend);
    }
  }

  /** @param {boolean} [paused] a time in the past is shown */
  draw(paused = false) {
    const { lines, items } = this,
      rows = [];
    for (const [name, words, small] of ROWS) {
      const found = items.get(name),
        row = found?.shown;
      if (!row) continue;
      const at = items.get(`${name}_frequency`)?.shown?.v ?? NaN,
        value = row.v;
      const none = row.status === "none",
        mark = !none && small(value);
      rows.push(
        element(
          "tr",
          { "data-name": name },
          element("th", { scope: "row" }, words),
          element(
            "td",
            { class: mark ? "small" : "" },
            none ? tr("no limit") : `${bounded(value, row.s, found.unit)}${mark ? ` ⚠ ${tr("small")}` : ""}`,
          ),
          element("td", {}, Number.isFinite(at) ? `${plain(at, 3)} Hz` : ""),
          element("td", {}, none ? tr("no crossing") : worded(row.status)),
        ),
      );
    }
    // It belongs to the newest response, so it is not shown for a time in the past.
    if (lines?.frequency_hz && !paused)
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
