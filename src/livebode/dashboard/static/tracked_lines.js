// @ts-check
// Which lines are tracked: those of the address, in Hz, or those that matter, or some over the whole band.
import { chosen, remember } from "./address.js";

const AT_FIRST = 6,
  LINES_MAX = 10;

/**
 * The lines nearest to these frequencies; some over the whole band if there are none.
 *
 * @param {number[]} lines Hz
 * @param {number[]} places Hz
 */
export function linesNear(lines, places) {
  const near = places.map((hz) =>
    lines.reduce((best, f, i) => (Math.abs(Math.log(f / hz)) < Math.abs(Math.log(lines[best] / hz)) ? i : best), 0),
  );
  return near.length ? [...new Set(near)].slice(0, LINES_MAX) : overBand(lines);
}

/** @param {number[]} lines frequencies, Hz */
function overBand(lines) {
  const n = Math.min(AT_FIRST, lines.length);
  return Array.from({ length: n }, (_, i) => Math.round((i * (lines.length - 1)) / Math.max(1, n - 1)));
}

/**
 * @param {number[]} lines
 * @param {number[]} indices
 */
const text = (lines, indices) => indices.map((i) => Number(lines[i].toPrecision(7))).join(" ");

/**
 * Indices of the lines of the address; empty if it names none.
 *
 * @param {number[]} lines
 */
export function linesInAddress(lines) {
  const asked = chosen("lines", "").split(" ").map(Number);
  const found = asked.map((f) => lines.findIndex((g) => Math.abs(g / f - 1) < 1e-6)).filter((i) => i >= 0);
  return [...new Set(found)].slice(0, LINES_MAX);
}

/**
 * @param {number[]} lines
 * @param {number[]} indices
 */
export const rememberLines = (lines, indices) => remember("lines", text(lines, indices), "");

/**
 * Add or remove a line; the one that was chosen first gives way to an eleventh.
 *
 * @param {number[]} indices changed in place
 * @param {number} i
 */
export function toggle(indices, i) {
  const place = indices.indexOf(i);
  if (place >= 0) indices.splice(place, 1);
  else indices.push(i);
  if (indices.length > LINES_MAX) indices.shift();
}
