// @ts-check
// The values at the pointer.
import { element } from "./make.js";
import { nameOf } from "./names.js";
import { angle, frequency, level } from "./values.js";

/** @import { Chart } from "./chart.js" */
/** @import { Curves, Found } from "./messages.js" */
/** @import { View } from "./view.js" */

const ROOM = 14;

export class Tooltip {
  constructor() {
    // What it shows is in the read-out too, which a screen reader reads.
    this.host = element("div", { class: "bode-tip", "aria-hidden": "true", hidden: true });
  }

  hide() {
    this.host.hidden = true;
  }

  /**
   * @param {Chart} u
   * @param {number} hz
   * @param {Found} found
   * @param {View} view
   */
  show(u, hz, found, view) {
    const { host } = this,
      { over } = u,
      { left = 0, top = 0 } = u.cursor;
    const rows = /** @type {Curves[]} */ (Object.keys(found)).map((name) => {
      const { db, deg } = found[name] ?? { db: NaN, deg: NaN };
      return element("div", {}, `${nameOf(name)} ${level(db, view)}, ${angle(deg)}`);
    });
    host.replaceChildren(element("b", {}, frequency(hz, view)), ...rows);
    if (host.parentElement !== over) over.append(host);
    host.hidden = false;
    const right = left + ROOM + host.offsetWidth < over.clientWidth;
    host.style.left = `${right ? left + ROOM : Math.max(0, left - ROOM - host.offsetWidth)}px`;
    host.style.top = `${Math.max(0, Math.min(top + ROOM, over.clientHeight - host.offsetHeight))}px`;
  }
}
