// @ts-check
// The values at the cursor: Hz, dB, degrees, their bounds, coherence, and the difference from the reference.
import { moment } from "./clock.js";
import { halfDeg, highDb, holds, lowDb } from "./frames.js";
import { element } from "./make.js";
import { hertz, signed } from "./words.js";

/** @import { AtCursor, Curves, Found, Named } from "./messages.js" */

const WORDS = { measured: "measured", reference: "reference", baseline: "baseline", model: "fitted model" };

/**
 * @param {number} low
 * @param {number} value
 * @param {number} high
 */
function around(low, value, high) {
  if (!Number.isFinite(value - low) || low <= -999) return Number.isFinite(high) ? "includes zero" : "bound not known";
  return `−${(value - low).toFixed(2)} … +${(high - value).toFixed(2)} dB`;
}

/**
 * @param {HTMLElement} host
 * @param {number} hz
 * @param {Found} found
 * @param {Named} schedule
 */
export function readout(host, hz, found, schedule) {
  const shown = /** @type {[Curves, AtCursor][]} */ (Object.entries(found));
  const rows = shown.map(([name, { db, deg, reach, coherence }]) => {
    const away = name !== "measured" && found.measured ? [db - found.measured.db, deg - found.measured.deg] : null;
    return element(
      "tr",
      { "data-name": name },
      element("th", { scope: "row" }, WORDS[name]),
      element("td", {}, `${signed(db, 2)} dB`),
      element("td", {}, name === "model" ? "" : around(lowDb(db, reach), db, highDb(db, reach))),
      element("td", {}, `${signed(deg, 1)}°`),
      element("td", {}, Number.isFinite(reach) ? `± ${halfDeg(reach).toFixed(1)}°` : ""),
      element("td", {}, Number.isFinite(coherence) ? `γ² ${coherence.toFixed(3)}` : ""),
      element("td", {}, away ? `measured ${signed(-away[0], 2)} dB, ${signed(-away[1], 1)}° off` : ""),
    );
  });
  const frame = found.measured?.frame;
  const words = frame
    ? `at ${moment(frame.timeS[0], true)}${Number.isFinite(frame.schedule[0]) ? `, ${schedule.name || "schedule"} ${frame.schedule[0].toFixed(3)} ${schedule.unit}` : ""}` +
      `; bands are ±3σ${Number.isFinite(frame.dof[0]) || frame.dof[0] === Infinity ? ` and cover the true value with ${(100 * holds(frame.dof[0])).toFixed(2)} %` : ""}`
    : "no response yet";
  host.replaceChildren(
    element(
      "table",
      {},
      element("thead", {}, element("tr", {}, element("th", { colspan: 7 }, `${hertz(hz)} Hz`))),
      element("caption", {}, words),
      element("tbody", {}, ...(rows.length ? rows : [element("tr", {}, element("th", {}, "–"))])),
    ),
  );
}
