// @ts-check
// The colour, the dash and the marker of each curve of the Bode plot: never the colour alone.
import { colour } from "./theme.js";

/** @import { Curves } from "./messages.js" */
/** @typedef {{ink: string, dash: number[], marker: Marker}} Look */
/** @typedef {"circle" | "square" | "diamond" | "up" | "down" | "cross" | "plus" | "ring"} Marker */

/** @type {Record<Curves, Look>} */
const LOOKS = {
  measured: { ink: "measured", dash: [], marker: "circle" },
  reference: { ink: "reference", dash: [8, 4], marker: "square" },
  "reference 2": { ink: "t3", dash: [10, 3, 2, 3], marker: "diamond" },
  "reference 3": { ink: "t7", dash: [4, 4], marker: "up" },
  "reference 4": { ink: "t9", dash: [12, 4], marker: "down" },
  "reference 5": { ink: "t1", dash: [6, 2, 2, 2], marker: "cross" },
  "reference 6": { ink: "t5", dash: [3, 3], marker: "plus" },
  "reference 7": { ink: "t6", dash: [14, 3, 3, 3, 3, 3], marker: "square" },
  "reference 8": { ink: "t4", dash: [2, 2], marker: "diamond" },
  baseline: { ink: "baseline", dash: [2, 3], marker: "ring" },
  model: { ink: "model", dash: [5, 2], marker: "ring" },
  "what if": { ink: "t8", dash: [7, 3], marker: "plus" },
  result: { ink: "measured", dash: [], marker: "circle" },
};

/** @param {Curves} name */
export const look = (name) => LOOKS[name];

/** @param {Curves} name */
export const ink = (name) => colour(LOOKS[name].ink);

/** Paths of the markers around (13, 6). @type {Record<Marker, string>} */
const PATHS = {
  circle: "M9 6a4 4 0 1 0 8 0a4 4 0 1 0-8 0",
  ring: "M9 6a4 4 0 1 0 8 0a4 4 0 1 0-8 0",
  square: "M9 2h8v8h-8z",
  diamond: "M13 2l4 4l-4 4l-4-4z",
  up: "M13 2l4 8h-8z",
  down: "M13 10l4-8h-8z",
  cross: "M9 2l8 8M9 10l8-8",
  plus: "M9 6h8M13 2v8",
};

/**
 * A curve as in the plot, as a small picture for a legend: its line, or where only points are drawn its marker.
 *
 * @param {Curves} name
 * @param {boolean} points
 */
export function swatch(name, points) {
  const { ink: variable, dash, marker } = LOOKS[name],
    line = !points || name === "model";
  if (line) return sign(variable, "M0 6h26", 2.4, false, dash.join(" "));
  return sign(variable, PATHS[marker], 1.8, marker === "circle");
}

/** A part of a bound as a small picture for a legend. @param {string} variable its colour in look.css */
export const partSwatch = (variable) => sign(variable, "M4 3h18v6h-18z", 1, true);

/**
 * @param {string} variable a colour in look.css
 * @param {string} d
 * @param {number} width
 * @param {boolean} filled
 * @param {string} [dash]
 */
function sign(variable, d, width, filled, dash) {
  const ns = "http://www.w3.org/2000/svg";
  const svg = document.createElementNS(ns, "svg"),
    path = document.createElementNS(ns, "path");
  for (const [key, value] of Object.entries({ width: 26, height: 12, "aria-hidden": "true", class: "swatch-line" }))
    svg.setAttribute(key, String(value));
  path.setAttribute("d", d);
  path.setAttribute("stroke-width", String(width));
  if (dash) path.setAttribute("stroke-dasharray", dash);
  path.style.stroke = `var(--${variable})`;
  path.style.fill = filled ? `var(--${variable})` : "none";
  svg.append(path);
  return svg;
}
