// @ts-check
// The past: times in the record, and the history in the tracking plot and the map.
import { curveIn, framesOf } from "./frames.js";
import { ask, reason } from "./link.js";

/** @import { Page } from "./messages.js" */

const WHOLE_MS = 4000,
  ROWS = 1000,
  // While new responses arrive, no denser than these.
  ROWS_LIVE = 400;

/**
 * @param {Page} page
 * @param {object} parts
 * @param {import("./bode.js").Bode} parts.bode
 * @param {import("./tracking.js").Tracking} parts.tracking
 * @param {import("./timeline.js").Timeline} parts.timeline
 * @param {import("./link.js").Link} parts.link
 * @param {{complain: (text: string) => void, status: () => void, showFits: (fits: import("./messages.js").Fits) => void}} actions
 */
export function past(page, { bode, tracking, timeline, link }, { complain, status, showFits }) {
  let filledMs = -1e9;
  // The time before this page was opened: first the recent past, the whole run on request.
  async function fill() {
    const { span } = timeline,
      whole = page.spanS === "whole",
      half = Number(page.spanS) / 2;
    const { facts } = page;
    const between = facts?.axis !== page.axis || page.quantity === null; // another axis was chosen, and its facts have not arrived
    if (between || !facts.begun || !Number.isFinite(span.last_s)) {
      setTimeout(fill, 300);
      return;
    }
    const newest =
      timeline.atS === null ? span.last_s : whole ? span.last_s : Math.min(span.last_s, timeline.atS + half);
    const [from, end] = page.zoom ?? [
      whole ? span.first_s : Math.max(span.first_s, newest - Number(page.spanS)),
      newest,
    ];
    const asked = `${page.key} ${from} ${end}`;
    page.asked = asked;
    const live = !page.zoom && !whole && timeline.atS === null;
    const rows = live ? ROWS_LIVE : ROWS;
    try {
      const frame = curveIn(await ask("/api/past", { axis: page.axis, quantity: page.quantity, from, to: end, rows }));
      if (page.asked !== asked) return;
      page.past = { frame, from, to: end };
      if (live) page.rows = page.rows.behind(frame);
    } catch (error) {
      complain(reason(error));
    }
    page.dirty.add("rows");
  }

  /** @param {number} timeS */
  async function showMoment(timeS) {
    link.request({ kind: "pause" }, "pause");
    page.dirty.add("trends");
    status();
    tracking.marked = timeS;
    if (page.seeking) {
      page.next = timeS;
      return;
    }
    page.seeking = true;
    try {
      const buffer = await ask("/api/moment", { axis: page.axis, quantity: page.quantity, from: timeS, to: timeS });
      if (timeline.atS !== null) {
        bode.drop("model");
        bode.drop("baseline");
        for (const frame of framesOf(buffer)) {
          if (frame.quantity !== page.quantity) continue;
          if (frame.kind === "fits") showFits(frame);
          else bode.take(frame);
        }
        timeline.draw();
        page.dirty.add("bode");
      }
      const { past } = page;
      const kept = past && (page.zoom || (timeS >= past.from && timeS <= past.to && page.spanS === "whole"));
      if (!kept) await fill();
      page.dirty.add("rows");
    } catch (error) {
      complain(reason(error));
    }
    page.seeking = false;
    if (page.next !== undefined) {
      const next = page.next;
      page.next = undefined;
      if (timeline.atS !== null) showMoment(next);
    }
  }

  function goLive() {
    tracking.marked = NaN;
    link.forget("pause");
    link.request({ kind: "resume" });
    page.rows.clear();
    page.dirty.add("trends");
    fill();
    status();
  }

  /** @param {number} now */
  function drawRows(now) {
    const { span } = timeline,
      whole = page.spanS === "whole",
      paused = timeline.atS !== null;
    const end = Math.max(span.last_s, page.rows.lastS || -Infinity);
    /** @type {import("./messages.js").History} */
    let rows = page.rows;
    let from = end - Number(page.spanS),
      to = end;
    if (page.zoom) {
      rows = page.past?.frame ?? rows;
      [from, to] = page.zoom;
    } else if ((whole || paused) && page.past) {
      rows = page.past.frame;
      ({ from, to } = page.past);
      if (whole && !paused && span.live && now - filledMs > WHOLE_MS) {
        filledMs = now;
        fill();
      }
    } else if (!whole && !paused) from = Math.max(from, Math.min(span.first_s, end));
    page.seen = [rows, from, to];
    tracking.draw(...page.seen);
    if (page.tab === "map") page.dirty.add("map");
  }

  return { fill, showMoment, goLive, drawRows };
}
