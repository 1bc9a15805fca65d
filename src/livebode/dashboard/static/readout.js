// @ts-check
// The values at the cursor, their bounds and distances from the measured curve; what lies between the fixed cursors.
import { moment } from "./clock.js";
import { differences } from "./cursors.js";
import { halfDeg, highDb, lowDb } from "./frames.js";
import { tr } from "./language.js";
import { element } from "./make.js";
import { nameOf } from "./names.js";
import { shown } from "./parts.js";
import { angle, bounds, frequency, halfAngle, level } from "./values.js";
import { fixed, plain, signed } from "./words.js";

/** @import { Bode } from "./bode.js" */
/** @import { AtCursor, Curves, Found, Frame, Named } from "./messages.js" */

const NEAR = 0.05; // a mode of the fit is that of a peak within this share of its frequency

/**
 * @param {number} low
 * @param {number} value
 * @param {number} high
 * @param {import("./view.js").View} view
 */
function around(low, value, high, view) {
  if (!Number.isFinite(value - low) || low <= -999)
    return Number.isFinite(high) ? tr("includes zero") : tr("bound not known");
  return bounds(low, value, high, view);
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

/** The time of the fit, where it is not that of the response. @param {Found} found */
function fitted({ measured, model }) {
  const timeS = model?.frame?.timeS[0];
  if (timeS === undefined || timeS === measured?.frame?.timeS[0]) return "";
  return tr("fitted model at {time}", { time: moment(timeS, true) });
}

/**
 * @param {Found} found
 * @param {Bode} bode
 */
function rowsOf(found, { view }) {
  const shown = /** @type {[Curves, AtCursor][]} */ (Object.entries(found));
  return shown.map(([name, { db, deg, reach, coherence }]) => {
    const away = name !== "measured" && found.measured ? [db - found.measured.db, deg - found.measured.deg] : null;
    return element(
      "tr",
      { "data-name": name },
      element("th", { scope: "row" }, nameOf(name)),
      element("td", {}, level(db, view)),
      element("td", {}, name === "model" ? "" : around(lowDb(db, reach), db, highDb(db, reach), view)),
      element("td", {}, angle(deg)),
      element("td", {}, Number.isFinite(reach) ? halfAngle(halfDeg(reach)) : ""),
      element("td", {}, Number.isFinite(coherence) ? `γ² ${fixed(coherence, 3)}` : ""),
      element(
        "td",
        {},
        away ? tr("measured {db} dB, {deg}° off", { db: signed(-away[0], 2), deg: signed(-away[1], 1) }) : "",
      ),
    );
  });
}

/** The distance from cursor A to cursor B. @param {Bode} bode */
function between(bode) {
  const [a, b] = bode.cursors.hz;
  if (a === null && b === null) return [];
  if (a === null || b === null) {
    const placed = tr("cursor {name} at {frequency}", {
      name: a === null ? "B" : "A",
      frequency: frequency(a ?? b ?? 0, bode.view),
    });
    return [element("p", { class: "cursors" }, placed)];
  }
  const [from, to] = [bode.nearest(a), bode.nearest(b)],
    step = bode.lines[to] - bode.lines[from];
  const head = tr("B less A: {from} to {to}, {step}, ratio {ratio}", {
    from: frequency(bode.lines[from], bode.view),
    to: frequency(bode.lines[to], bode.view),
    step: `${step < 0 ? "−" : "+"}${frequency(Math.abs(step), bode.view)}`,
    ratio: plain(bode.lines[to] / bode.lines[from], 4),
  });
  const rows = differences(bode.valuesAt(from), bode.valuesAt(to)).map(({ name, db, deg, ratio }) =>
    element(
      "tr",
      { "data-difference": name },
      element("th", { scope: "row" }, nameOf(name)),
      element("td", {}, `${signed(db, 2)} dB`),
      element("td", {}, `× ${plain(ratio, 4)}`),
      element("td", {}, angle(deg)),
    ),
  );
  return [element("table", { class: "cursors" }, element("caption", {}, head), element("tbody", {}, ...rows))];
}

/** The parts of the bound that are drawn. @param {Bode} bode @param {Found} found */
function partsOf({ parted, parts, symbol }, { measured }) {
  if (!parted || !measured || !Number.isFinite(measured.reach)) return [];
  const each = shown(parts).map(({ words, i }) => `${words} ${plain(100 * measured.parts[i], 2)} %`);
  const words = tr("parts of the 95 % bound, of |{symbol}|: {parts}", { symbol, parts: each.join(", ") });
  return [element("p", { class: "parts" }, words)];
}

/** The peak or antiresonance that was searched for. @param {Bode} bode */
function extremum(bode) {
  const found = bode.extremum;
  if (!found) return [];
  const { peak, hz, db, damping, of } = found;
  const kind = peak ? tr("peak") : tr("antiresonance");
  const width = Number.isFinite(damping)
    ? tr("{value} (half power)", { value: plain(damping, 3) })
    : tr("not known (no half power beside it)");
  const what = tr("{what} of {curve}: {frequency}, {level}, damping {damping}", {
    what: kind,
    curve: nameOf(of),
    frequency: frequency(hz, bode.view),
    level: level(db, bode.view),
    damping: width,
  });
  const mode = bode.known.modes().find((one) => one.peak === peak && Math.abs(one.hz / hz - 1) < NEAR);
  return [element("p", { class: "extremum" }, mode ? `${what}; ${mode.words}` : what)];
}

/**
 * @param {HTMLElement} host
 * @param {number} hz
 * @param {Found} found
 * @param {Named} schedule
 * @param {Bode} bode
 */
export function readout(host, hz, found, schedule, bode) {
  const rows = rowsOf(found, bode);
  const frame = found.measured?.frame;
  const words = bode.operation
    ? tr("bounds: 95 %; the errors of A and B are taken as independent")
    : frame
      ? [tr("{where}; bounds: 95 %", { where: where(frame, schedule) }), fitted(found)].filter(Boolean).join("; ")
      : tr("no response yet");
  host.replaceChildren(
    element(
      "table",
      {},
      element("thead", {}, element("tr", {}, element("th", { colspan: 7 }, frequency(hz, bode.view)))),
      element("caption", {}, words),
      element("tbody", {}, ...(rows.length ? rows : [element("tr", {}, element("th", {}, "–"))])),
    ),
    ...partsOf(bode, found),
    ...extremum(bode),
    ...between(bode),
  );
}
