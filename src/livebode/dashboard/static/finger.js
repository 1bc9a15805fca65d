// @ts-check
// A finger that is dragged across a chart selects a band; two taps show the full band.

/**
 * @param {import("./chart.js").Chart} u
 * @param {() => void} choose
 * @param {() => void} whole
 */
export function byFinger(u, choose, whole) {
  /** @type {number | null} */
  let from = null;
  let tapped = -1e9;
  /** @param {PointerEvent} event */
  const x = (event) => event.clientX - u.over.getBoundingClientRect().left;
  u.over.addEventListener("pointerdown", (event) => {
    if (event.pointerType === "touch") from = x(event);
  });
  u.over.addEventListener("pointermove", (event) => {
    if (from === null || event.pointerType !== "touch") return;
    const [left, width] = [Math.min(from, x(event)), Math.abs(x(event) - from)];
    u.setSelect({ left, width, top: 0, height: u.over.clientHeight }, false);
  });
  u.over.addEventListener("pointercancel", () => {
    from = null;
  });
  u.over.addEventListener("pointerup", (event) => {
    if (from === null || event.pointerType !== "touch") return;
    const across = Math.abs(x(event) - from) > 24;
    if (across) choose();
    else if (event.timeStamp - tapped < 350) whole();
    tapped = across ? -1e9 : event.timeStamp;
    from = null;
  });
}
