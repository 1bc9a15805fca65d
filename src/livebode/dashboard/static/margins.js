// @ts-check
// The margins of the loop with their bounds; small ones are marked.
import { element } from "./make.js";
import { Series } from "./series.js";
import { bounded } from "./trends.js";
import { hertz, plain } from "./words.js";

/** @import { AtLines, Trend } from "./messages.js" */

/**
 * Usual limits of a servo loop: 6 dB, 30°, Ms 2. Worse values are marked, with a word.
 *
 * @type {[name: string, words: string, small: (v: number) => boolean][]}
 */
const ROWS = [
  ["gain_margin", "gain may rise by", (v) => v < 6],
  ["gain_reduction", "gain may fall by", (v) => Math.abs(v) < 6],
  ["phase_margin", "phase margin", (v) => Math.abs(v) < 30],
  ["delay_margin", "delay margin", () => false],
  ["peak_sensitivity", "peak sensitivity Ms", (v) => v > 2],
  ["bandwidth", "bandwidth", () => false],
];

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
            none ? "no limit" : `${bounded(value, found.s[row], found.unit)}${mark ? " ⚠ small" : ""}`,
          ),
          element("td", {}, Number.isFinite(at) ? `${plain(at, 3)} Hz` : ""),
          element("td", {}, none ? "no crossing" : found.status[row]),
        ),
      );
    }
    // It belongs to the newest response, so it is not shown for a time in the past.
    if (lines && !Number.isFinite(atS))
      rows.push(
        element(
          "tr",
          { "data-name": "at_lines" },
          element("th", { scope: "row" }, "largest |S| at a line"),
          element(
            "td",
            { class: lines.value > 2 ? "small" : "" },
            `${plain(lines.value, 3)} ± ${plain(lines.bound, 2)}${lines.value > 2 ? " ⚠ large" : ""}`,
          ),
          element("td", {}, `${hertz(lines.frequency_hz)} Hz`),
          element("td", {}, "measured, without a model"),
        ),
      );
    if (!rows.length) {
      this.host.replaceChildren(element("p", { class: "empty" }, this.why));
      return;
    }
    const head = ["margin", "value, ± 95 % if the model is complete", "at", "source"].map((t) =>
      element("th", { scope: "col" }, t),
    );
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
