// @ts-check
// Mouse, wheel and fingers on a chart: a box to zoom, a drag or wheel with Shift or the middle button to move, two fingers.

/** @import { Chart } from "./chart.js" */

/**
 * What a gesture asks for, in shares of the chart: 0 is left or top, 1 is right or bottom.
 *
 * @typedef {object} Gestures
 * @property {(x: number, y: number, factorX: number, factorY: number) => void} scale around a point; one leaves an axis
 * @property {(x: number, y: number) => void} shift
 * @property {(x: [number, number] | null, y: [number, number] | null) => void} box
 * @property {(second: boolean, touch: boolean) => void} place a click or a tap at the cursor, `second` with Shift
 * @property {() => void} reset two clicks, of which the first was a place
 */

/** Whether the page is longer than the screen: the wheel scrolls it then, and with Ctrl it zooms a chart. */
export const scrolls = () => document.documentElement.scrollHeight > innerHeight + 1;

const NOTCH = 1.5, // of a zoom
  NOTCH_PX = 100, // of a wheel
  LINE_PX = 16;
const CLICK_PX = 4;
const WIDE_PX = 8,
  HIGH_PX = 20,
  FINGER_PX = 24;
const TAPS_MS = 350;

/**
 * @param {Chart} u
 * @param {Gestures} to
 * @param {"x" | "xy"} axes along which a person may zoom
 */
export function gestures(u, to, axes = "xy") {
  const { over, root } = u;
  /** @type {Map<number, PointerEvent>} */
  const down = new Map();
  /** @type {{from: [number, number], last: [number, number], moves: boolean, touch: boolean} | null} */
  let drag = null;
  /** The pointer that went up where it had gone down. @type {PointerEvent | null} */
  let still = null;
  let tapped = -1e9;
  /** @param {{clientX: number, clientY: number}} event @returns {[number, number]} */
  const place = (event) => {
    const box = over.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  /** @param {[number, number]} at */
  const shares = ([x, y]) => /** @type {[number, number]} */ ([x / over.clientWidth, y / over.clientHeight]);
  const none = () => u.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);

  /** The box from the start of the drag. @param {[number, number]} at @param {boolean} touch */
  function boxed([x, y], touch) {
    const [x0, y0] = drag?.from ?? [x, y],
      wide = Math.abs(x - x0) > (touch ? FINGER_PX : WIDE_PX),
      high = axes === "xy" && !touch && Math.abs(y - y0) > HIGH_PX;
    return {
      wide,
      high,
      left: wide ? Math.min(x0, x) : 0,
      width: wide ? Math.abs(x - x0) : over.clientWidth,
      top: high ? Math.min(y0, y) : 0,
      height: high ? Math.abs(y - y0) : over.clientHeight,
    };
  }

  /** Two fingers: each keeps its value, along an axis on which they are far enough apart. @param {PointerEvent} event */
  function pinch(event) {
    const [other] = [...down.values()].filter((one) => one.pointerId !== event.pointerId),
      before = down.get(event.pointerId);
    if (!other || !before) return;
    const [o, b, now] = [place(other), place(before), place(event)];
    /** @param {0 | 1} k */
    const factor = (k) =>
      Math.abs(b[k] - o[k]) > 2 * FINGER_PX ? Math.abs(b[k] - o[k]) / Math.max(FINGER_PX, Math.abs(now[k] - o[k])) : 1;
    to.scale(...shares(o), factor(0), factor(1));
  }

  over.addEventListener("pointerdown", (event) => {
    if (event.button > 1) return;
    down.set(event.pointerId, event);
    const at = place(event),
      touch = event.pointerType === "touch";
    drag = down.size > 1 ? null : { from: at, last: at, moves: event.shiftKey || event.button === 1, touch };
    if (!touch) over.setPointerCapture(event.pointerId);
    if (event.button === 1) event.preventDefault();
    none();
  });
  over.addEventListener("pointermove", (event) => {
    if (!down.has(event.pointerId)) return;
    if (down.size === 2) pinch(event);
    down.set(event.pointerId, event);
    if (!drag) return;
    const at = place(event);
    if (drag.moves) {
      if (Math.hypot(at[0] - drag.from[0], at[1] - drag.from[1]) > CLICK_PX || drag.last !== drag.from) {
        const [x0, y0] = shares(drag.last),
          [x, y] = shares(at);
        drag.last = at;
        to.shift(x0 - x, y - y0);
      }
      return;
    }
    const { wide, high, left, top, width, height } = boxed(at, drag.touch);
    if (wide || high) u.setSelect({ left, top, width, height }, false);
    else none();
  });
  /** @param {PointerEvent} event */
  const end = (event) => {
    down.delete(event.pointerId);
    const ended = drag;
    const at = place(event);
    const box = boxed(at, event.pointerType === "touch");
    drag = still = null;
    none();
    if (!ended || event.type === "pointercancel") return;
    const near = Math.hypot(at[0] - ended.from[0], at[1] - ended.from[1]) <= (ended.touch ? FINGER_PX : CLICK_PX);
    if (near) still = event;
    else if (!ended.moves && (box.wide || box.high)) {
      const [x0, y0] = shares([box.left, box.top]),
        [x1, y1] = shares([box.left + box.width, box.top + box.height]);
      to.box(box.wide ? [x0, x1] : null, box.high ? [y0, y1] : null);
    }
  };
  over.addEventListener("pointerup", end);
  over.addEventListener("pointercancel", end);
  // The click comes after the cursor has moved to a tap, and counts the clicks as the system does.
  over.addEventListener("click", (event) => {
    if (!still) return;
    const touch = still.pointerType === "touch",
      again = touch && event.timeStamp - tapped < TAPS_MS;
    if (touch) tapped = event.timeStamp;
    if (again) to.reset();
    else if (event.detail < 2) to.place(event.shiftKey, touch);
  });
  over.addEventListener("dblclick", () => to.reset());
  root.addEventListener("wheel", (event) => turned(event, u, to, axes), { passive: false });
}

/**
 * @param {WheelEvent} event
 * @param {Chart} u
 * @param {Gestures} to
 * @param {"x" | "xy"} axes
 */
function turned(event, { over }, to, axes) {
  if (event.ctrlKey !== scrolls()) return; // the browser's own zoom, or its scrolling of a page that is longer
  event.preventDefault();
  const { shiftKey, deltaX, deltaY, deltaMode } = event,
    px = deltaMode === 1 ? LINE_PX : 1,
    across = shiftKey ? deltaX + deltaY : deltaX;
  if (shiftKey || Math.abs(across) > Math.abs(deltaY)) {
    to.shift((across * px) / over.clientWidth, 0);
    return;
  }
  const box = over.getBoundingClientRect(),
    [x, y] = [(event.clientX - box.left) / box.width, (event.clientY - box.top) / box.height],
    factor = NOTCH ** (Math.max(-400, Math.min(400, deltaY * px)) / NOTCH_PX);
  // Beside the chart are its axes.
  if (axes === "x") to.scale(Math.max(0, x), y, factor, 1);
  else to.scale(x, y, x < 0 ? 1 : factor, y > 1 ? 1 : factor);
}
