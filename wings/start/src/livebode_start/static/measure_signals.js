// @ts-check
// The signals over time, one plot below the other: the smallest and the largest sample of each pixel.
import { axis, chart } from "./chart.js";
import { gestures } from "./gestures.js";
import { tr } from "./language.js";
import { element } from "./make.js";
import { CHANNEL_TYPE, ROLES, roleName } from "./measure_roles.js";
import { json } from "./runs_feed.js";
import { colour } from "./theme.js";
import { plain } from "./words.js";
import { scaled, shifted } from "./zoom.js";

/** @import { Chart, Range } from "./chart.js" */
/** @import { Channel, Role } from "./measure_roles.js" */
/** @typedef {{from_s: number, step_s: number, low: (number | null)[], high: (number | null)[] | null}} Preview */

const FETCH_MS = 120,
  SHOWN = 8;

export class Signals {
  /**
   * @param {HTMLElement} host
   * @param {HTMLButtonElement} more
   * @param {{recording: string, rate_hz: number, rate_given: boolean, begin_s: number, end_s: number, channels: Channel[]}} facts
   * @param {(error: unknown) => void} onError
   */
  constructor(host, more, facts, onError) {
    this.facts = facts;
    this.onError = onError;
    /** @type {Range} what is shown */
    this.span = [facts.begin_s, facts.end_s];
    /** @type {Range} what is used */
    this.used = [...this.span];
    /** @type {() => void} */
    this.onZoom = () => {};
    this.waiting = 0;
    /** @type {Map<string, {row: HTMLElement, badge: HTMLElement, plot: HTMLElement, made: Chart | null}>} */
    this.rows = new Map();
    const varying = facts.channels.filter((channel) => !channel.constant);
    for (const channel of varying) this.rows.set(channel.name, this.row(channel));
    const rows = [...this.rows.values()].map(({ row }) => row);
    host.replaceChildren(...rows);
    const hidden = rows.slice(SHOWN);
    for (const row of hidden) row.hidden = true;
    more.hidden = !hidden.length;
    more.textContent = tr("Show all {count}", { count: rows.length });
    more.addEventListener("click", () => {
      for (const row of hidden) row.hidden = false;
      more.hidden = true;
      this.fetch();
    });
  }

  /** @param {Channel} channel */
  row({ name, unit, not_finite: missing }) {
    const badge = element("span", { class: "badge" }),
      plot = element("div", { class: "plot", role: "img", "aria-label": name }),
      handle = element("b", { draggable: "true", title: tr("Drag it to a role") }, name);
    handle.addEventListener("dragstart", (event) => event.dataTransfer?.setData(CHANNEL_TYPE, name));
    const remark = missing ? tr("{count} samples are not finite", { count: missing }) : "";
    const row = element(
      "div",
      { class: "signal", "data-name": name },
      element("h3", {}, handle, unit ? element("small", {}, unit) : "", badge, element("small", {}, remark)),
      plot,
    );
    return { row, badge, plot, made: /** @type {Chart | null} */ (null) };
  }

  /** @param {Partial<Record<Role, string>>} chosen */
  mark(chosen) {
    for (const [name, { row, badge }] of this.rows) {
      const role = ROLES.find((role) => chosen[role] === name);
      badge.textContent = role ? roleName(role) : "";
      row.dataset.role = role ?? "";
      if (role && row.hidden) {
        row.hidden = false;
        this.fetch();
      }
    }
  }

  /** @param {Range} used */
  use(used) {
    this.used = used;
    for (const { made } of this.rows.values()) made?.redraw(false);
  }

  /** @param {Range} span */
  zoom([from, to]) {
    const { begin_s: first, end_s: last, rate_hz: rate } = this.facts,
      size = Math.min(last - first, Math.max(8 / rate, to - from)),
      begin = Math.min(last - size, Math.max(first, from));
    this.span = [begin, begin + size];
    for (const { made } of this.rows.values()) made?.setScale("x", { min: begin, max: begin + size });
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => this.fetch(), FETCH_MS);
    this.onZoom();
  }

  get whole() {
    return this.span[0] <= this.facts.begin_s && this.span[1] >= this.facts.end_s;
  }

  async fetch() {
    const { recording, rate_hz, rate_given } = this.facts,
      span = this.span;
    for (const [name, { row, plot }] of this.rows) {
      if (row.hidden || span !== this.span) continue;
      const points = Math.max(100, Math.round(plot.clientWidth));
      const query = {
        recording,
        channel: name,
        from: span[0],
        to: span[1],
        points,
        ...(rate_given ? { rate_hz } : {}),
      };
      try {
        /** @type {Preview} */
        const preview = await json("/api/preview", query);
        if (span === this.span) this.draw(name, preview);
      } catch (error) {
        this.onError(error);
        return;
      }
    }
  }

  /**
   * @param {string} name
   * @param {Preview} preview
   */
  draw(name, { from_s: from, step_s: step, low, high }) {
    const row = this.rows.get(name);
    if (!row) return;
    /** @type {number[]} */
    const x = [];
    /** @type {(number | null)[]} */
    const y = [];
    low.forEach((value, i) => {
      x.push(from + i * step);
      y.push(value);
      if (!high) return;
      x.push(from + (i + 0.5) * step);
      y.push(high[i]);
    });
    row.made ??= this.build(row.plot);
    row.made.setData([x, y], false);
    row.made.setScale("x", { min: this.span[0], max: this.span[1] });
  }

  /** @param {HTMLElement} host */
  build(host) {
    const made = chart(
      host,
      {
        padding: [6, 12, 0, 0],
        cursor: {
          y: false,
          points: { show: false },
          drag: { x: false, y: false, setScale: false },
          sync: { key: "signals" },
        },
        scales: { x: { time: false }, y: { range: (_u, low, high) => reach(low, high) } },
        axes: [
          axis(() => "", { size: 20, values: (_u, splits) => splits.map((s) => `${plain(s, 6)} s`) }),
          axis(() => "", { size: 54, space: 16, values: (_u, splits) => splits.map((v) => plain(v, 4)) }),
        ],
        series: [{}, { label: "value", stroke: () => colour("measured"), width: 1, points: { show: false } }],
        hooks: { draw: [(u) => this.shade(u)] },
      },
      [[], []],
    );
    const at = (/** @type {number} */ share) => this.span[0] + share * (this.span[1] - this.span[0]);
    gestures(
      made,
      {
        scale: (x, _y, factor) => this.zoom(scaled(this.span, at(x), factor, false)),
        shift: (x) => this.zoom(shifted(this.span, x, false)),
        box: (x) => x && this.zoom([at(x[0]), at(x[1])]),
        place: () => {},
        reset: () => this.zoom([this.facts.begin_s, this.facts.end_s]),
      },
      "x",
    );
    return made;
  }

  /** What is not used is covered. @param {Chart} u */
  shade(u) {
    const { ctx, bbox } = u,
      [from, to] = this.used.map((s) =>
        Math.min(bbox.left + bbox.width, Math.max(bbox.left, u.valToPos(s, "x", true))),
      );
    ctx.save();
    ctx.globalAlpha = 0.75;
    ctx.fillStyle = colour("ground");
    ctx.fillRect(bbox.left, bbox.top, from - bbox.left, bbox.height);
    ctx.fillRect(to, bbox.top, bbox.left + bbox.width - to, bbox.height);
    ctx.restore();
  }
}

/**
 * @param {number | null} low
 * @param {number | null} high
 * @returns {Range}
 */
function reach(low, high) {
  if (low === null || high === null) return [0, 1];
  const room = high > low ? 0.06 * (high - low) : Math.abs(high) / 10 || 1;
  return [low - room, high + room];
}
