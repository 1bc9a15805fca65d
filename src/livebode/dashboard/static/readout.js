// @ts-check
// The values at the cursor: Hz, dB, degrees, their bounds, coherence, and the difference from the reference.
import { moment } from "./clock.js";
import { halfDeg, highDb, holds, lowDb } from "./frames.js";
import { tr } from "./language.js";
import { element } from "./make.js";
import { fixed, hertz, signed } from "./words.js";

/** @import { AtCursor, Curves, Found, Frame, Named } from "./messages.js" */

const WORDS = {
  measured: tr("measured"),
  reference: tr("reference"),
  baseline: tr("baseline"),
  model: tr("fitted model"),
};

/**
 * @param {number} low
 * @param {number} value
 * @param {number} high
 */
function around(low, value, high) {
  if (!Number.isFinite(value - low) || low <= -999)
    return Number.isFinite(high) ? tr("includes zero") : tr("bound not known");
  return `−${fixed(value - low, 2)} … +${fixed(high - value, 2)} dB`;
}

/**
 * @param {Frame} frame
 * @param {Named} schedule
 */
function where(frame, schedule) {
  const time = moment(frame.timeS[0], true),
    [at] = frame.schedule;
  if (!Number.isFinite(at)) return tr("at {time}", { time });
  const place = `${schedule.name || tr("schedule")} ${fixed(at, 3)} ${schedule.unit}`;
  return tr("at {time}, {place}", { time, place });
}

/** @param {Frame} frame */
function bands(frame) {
  const [dof] = frame.dof;
  if (Number.isNaN(dof)) return tr("bands are ±3σ");
  return tr("bands are ±3σ and cover the true value with {percent} %", { percent: fixed(100 * holds(dof), 2) });
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
      element("td", {}, Number.isFinite(reach) ? `± ${fixed(halfDeg(reach), 1)}°` : ""),
      element("td", {}, Number.isFinite(coherence) ? `γ² ${fixed(coherence, 3)}` : ""),
      element(
        "td",
        {},
        away ? tr("measured {db} dB, {deg}° off", { db: signed(-away[0], 2), deg: signed(-away[1], 1) }) : "",
      ),
    );
  });
  const frame = found.measured?.frame;
  const words = frame ? `${where(frame, schedule)}; ${bands(frame)}` : tr("no response yet");
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
