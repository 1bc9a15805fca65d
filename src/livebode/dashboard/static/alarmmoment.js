// @ts-check
// The moment of an alarm: the response at it, and as reference the one before the change began.
import { curveIn } from "./frames.js";
import { tr } from "./language.js";
import { ask, reason } from "./link.js";

/** @import { Frame, Notice, Page } from "./messages.js" */

const BEFORE_S = 60,
  ROWS = 1000;

/**
 * The row of a frame at the schedule nearest to `schedule`; the newest of equally near ones, or where nothing moves.
 *
 * @param {Frame} frame
 * @param {number} schedule
 */
export function nearest(frame, schedule) {
  let best = -1,
    least = Infinity;
  for (let r = 0; r < frame.rows; r++) {
    const values = frame.magnitude.subarray(r * frame.columns, (r + 1) * frame.columns);
    if (!values.some((v) => Number.isFinite(v))) continue; // not valid
    const away = Math.abs(frame.schedule[r] - schedule);
    const distance = Number.isFinite(away) ? away : 0;
    if (distance <= least) {
      least = distance;
      best = r;
    }
  }
  return best;
}

/**
 * @param {Page} page
 * @param {import("./timeline.js").Timeline} timeline
 * @param {object} parts
 * @param {import("./references.js").References} parts.references
 * @param {(text: string) => void} parts.complain
 */
export function alarmMoment(page, timeline, { references, complain }) {
  /**
   * @param {Notice | undefined} notice
   * @param {number} timeS
   */
  return async (notice, timeS) => {
    const { facts } = page;
    if (!facts?.begun) return;
    timeline.go(timeS);
    // A window that contains a sample of the change is not from before it.
    const windowS = facts.window / facts.rate_hz;
    const to = Math.min(notice?.alarm?.since_s ?? timeS, timeS) - windowS,
      from = Math.max(timeline.span.first_s, to - BEFORE_S);
    if (!(to > from)) return;
    const about = { axis: page.axis, quantity: page.quantity };
    try {
      const shown = curveIn(await ask("/api/moment", { ...about, from: timeS, to: timeS }));
      const before = curveIn(await ask("/api/past", { ...about, from, to, rows: ROWS }));
      const row = nearest(before, shown.schedule[0]);
      if (row < 0) complain(tr("The record has no valid response before this moment."));
      else references.replace({ timeS: before.timeS[row], saved: null }, tr("before the alarm"));
    } catch (error) {
      complain(reason(error));
    }
  };
}
