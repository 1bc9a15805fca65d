// @ts-check
// Small pictures over frequency as SVG: curves with bounds or points with error bars, logarithmic in frequency.
import { numeral } from "./language.js";
import { mark } from "./words.js";

/** @import { Sent } from "./messages.js" */
/** @typedef {{ink: string, dash?: string, values: Sent[], low?: Sent[], high?: Sent[]}} FigureCurve */
/**
 * @typedef {object} Figure
 * @property {number} width
 * @property {number} height
 * @property {number[]} hz
 * @property {FigureCurve[]} curves
 * @property {[low: number, high: number]} range
 * @property {boolean} points whether nothing is known between the values
 * @property {boolean} axes with numbers at the axes
 * @property {(v: number) => string} [words] of a number at the vertical axis
 */

const NS = "http://www.w3.org/2000/svg";
const [LEFT, BELOW, ABOVE] = [44, 20, 8];

/**
 * @param {keyof SVGElementTagNameMap} tag
 * @param {Record<string, string | number>} attributes
 * @param {string} [text]
 */
function svg(tag, { ink, ...attributes }, text) {
  const made = document.createElementNS(NS, tag);
  // A style attribute is refused by the page's policy.
  if (ink) made.style.setProperty("--ink-of-curve", `var(--${ink})`);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, String(value));
  if (text) made.textContent = text;
  return made;
}

/** Steps of 1, 2 or 5 for about so many marks. @param {number} span @param {number} count */
function step(span, count) {
  const least = span / count,
    power = 10 ** Math.floor(Math.log10(least));
  return ([1, 2, 5].find((s) => s * power >= least) ?? 10) * power;
}

/** @param {Figure} figure */
export function figure({ width, height, hz, curves, range, points, axes, words = mark }) {
  const [left, below, above] = axes ? [LEFT, BELOW, ABOVE] : [1, 1, 2],
    [low, high] = range,
    [f0, f1] = [hz[0] / 1.04, hz[hz.length - 1] * 1.04];
  const x = (/** @type {number} */ f) => left + ((width - left - 2) * Math.log(f / f0)) / Math.log(f1 / f0),
    y = (/** @type {number} */ v) =>
      above + (height - below - above) * (1 - (Math.min(high, Math.max(low, v)) - low) / (high - low));
  const at = (/** @type {number} */ v) => v.toFixed(1);
  const made = svg("svg", { viewBox: `0 0 ${width} ${height}`, "aria-hidden": "true", class: "figure" });
  for (let decade = 10 ** Math.floor(Math.log10(f0)); decade <= f1; decade *= 10)
    for (const by of [1, 2, 5]) {
      const f = by * decade;
      if (f < f0 || f > f1) continue;
      made.append(svg("path", { class: "grid", d: `M${at(x(f))} ${above}V${height - below}` }));
      if (axes)
        made.append(
          svg(
            "text",
            { x: at(x(f)), y: height - 6, "text-anchor": "middle" },
            numeral(String(Number(f.toPrecision(3)))),
          ),
        );
    }
  const by = step(high - low, axes ? 5 : 3);
  for (let v = by * Math.ceil(low / by); v <= high + 1e-9; v += by) {
    made.append(svg("path", { class: "grid", d: `M${left} ${at(y(v))}H${width - 2}` }));
    if (axes)
      made.append(svg("text", { x: left - 5, y: at(y(v) + 4), "text-anchor": "end" }, words(Number(v.toPrecision(6)))));
  }
  made.append(
    svg("rect", { class: "frame", x: left, y: above, width: width - left - 2, height: height - below - above }),
  );
  for (const curve of curves) draw(made, curve, { hz, points, x, y, at });
  return made;
}

/**
 * @param {SVGElement} host
 * @param {FigureCurve} curve
 * @param {{hz: number[], points: boolean, x: (f: number) => number, y: (v: number) => number, at: (v: number) => string}} on
 */
function draw(host, { ink, dash = "", values, low, high }, { hz, points, x, y, at }) {
  /** Runs of values that are known. @type {number[][]} */
  const runs = [[]];
  for (const [i, v] of values.entries()) {
    if (v !== null) runs[runs.length - 1].push(i);
    else if (runs[runs.length - 1].length) runs.push([]);
  }
  const place = (/** @type {number} */ i, /** @type {Sent[]} */ of) =>
    `${at(x(hz[i]))} ${at(y(of[i] ?? values[i] ?? 0))}`;
  for (const run of runs.filter((one) => one.length)) {
    if (points || run.length === 1) {
      if (low && high)
        host.append(
          svg("path", { ink, class: "bars", d: run.map((i) => `M${place(i, low)}L${place(i, high)}`).join("") }),
        );
      for (const i of run)
        host.append(svg("circle", { ink, class: "dot", cx: at(x(hz[i])), cy: at(y(values[i] ?? 0)), r: 1.8 }));
      continue;
    }
    if (low && high) {
      const edge = [...run.map((i) => place(i, high)), ...run.toReversed().map((i) => place(i, low))];
      host.append(svg("path", { ink, class: "band", d: `M${edge.join("L")}Z` }));
    }
    host.append(
      svg("path", {
        ink,
        class: "curve",
        "stroke-dasharray": dash,
        d: `M${run.map((i) => place(i, values)).join("L")}`,
      }),
    );
  }
}
