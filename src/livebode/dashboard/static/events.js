// @ts-check
// Alarms and events, one row for each cause, and the history of the alarms.

import { chosen, remember } from "./address.js";
import { chatters, historyRow, noticeRow, open } from "./alarmrows.js";
import { tr, trn } from "./language.js";
import { post, reason } from "./link.js";
import { choose, element, segments } from "./make.js";
import { askPerson, storedName } from "./person.js";
import { roving } from "./roving.js";
import { worded } from "./worded.js";

/** @import { Notice, Transition } from "./messages.js" */
/** @typedef {"all" | "alarms" | "history"} View */

const SHOWN_MAX = 300,
  HISTORY_MAX = 1000,
  DRAW_MS = 150;
/** @type {[value: View, text: string][]} */
const VIEWS = [
  ["all", tr("all")],
  ["alarms", tr("alarms")],
  ["history", tr("history")],
];
const RANK = ["unacknowledged", "returned", "acknowledged", "suppressed", "shelved"],
  PRIORITY = ["high", "medium", "low"];

/** @param {Notice} n */
const rank = ({ alarm }) =>
  alarm && alarm.state !== "normal" ? 3 * RANK.indexOf(alarm.state) + PRIORITY.indexOf(alarm.priority) : 99;

export class Events {
  /**
   * @param {{host: HTMLElement, views: HTMLElement, filter: HTMLInputElement, count: HTMLElement}} parts
   * @param {(text: string) => void} onError
   * @param {(cause: string, timeS: number) => void} onMoment
   */
  constructor({ host, views, filter, count }, onError, onMoment) {
    this.host = host;
    this.views = views;
    this.filter = filter;
    this.count = count;
    this.onError = onError;
    this.onMoment = onMoment;
    this.axis = 0;
    this.may = false;
    this.nowS = NaN;
    /** @type {Map<string, Notice>} */
    this.all = new Map();
    /** @type {Map<number, Transition>} */
    this.past = new Map();
    /** @type {Set<string>} causes whose acknowledgement is on its way */
    this.waiting = new Set();
    /** @type {string | undefined} the cause of the row that last had the focus */
    this.chosen = undefined;
    this.open = 0;
    this.drawn = -DRAW_MS;
    /** @type {Map<string, {key: string, row: HTMLElement}>} */
    this.rows = new Map();
    /** @type {number | undefined} */
    this.timer = undefined;
    /** @type {View} */
    this.view = chosen(
      "events",
      "all",
      VIEWS.map(([value]) => value),
    );
    segments(
      views,
      VIEWS.map(([value, text]) => ({ value, text })),
      this.view,
      (value) => this.show(value),
    );
    filter.placeholder = tr("filter");
    filter.addEventListener("input", () => this.draw());
    this.list = roving(host, (row, event) => this.key(row, event));
    host.addEventListener("focusin", ({ target }) => {
      const row = target instanceof Element && target.closest("[role=row]");
      if (row instanceof HTMLElement) this.chosen = row.dataset.cause;
    });
    host.addEventListener("click", ({ target }) => {
      const row = target instanceof Element && target.closest("[role=row]");
      if (row instanceof HTMLElement) this.go(row);
    });
    count.addEventListener("click", () => this.openAlarms());
  }

  /** @param {View} view */
  show(view) {
    this.view = view;
    choose(this.views, view);
    remember("events", view, "all");
    this.draw();
  }

  /** Show the list of alarms, and move the focus to it. */
  openAlarms() {
    this.show("alarms");
    this.list.focus();
    this.host.scrollIntoView({ block: "nearest" });
  }

  /**
   * @param {number} axis
   * @param {boolean} may whether this person may acknowledge
   */
  begin(axis, may) {
    this.axis = axis;
    this.may = may;
    this.chosen = undefined;
    this.all.clear();
    this.past.clear();
    this.draw();
  }

  /** Draw every row again: its times follow another clock. */
  redraw() {
    this.rows.clear();
    this.draw();
  }

  /**
   * @param {Notice[]} list
   * @param {Transition[]} history
   * @param {string[]} forgotten
   */
  take(list, history = [], forgotten = []) {
    for (const cause of forgotten) this.all.delete(cause);
    for (const notice of list) {
      this.all.delete(notice.cause); // the newest goes to the end
      this.all.set(notice.cause, notice);
      if (notice.seen >= notice.count) this.waiting.delete(notice.cause);
    }
    for (const one of history) this.past.set(one.number, one);
    for (const number of this.past.keys()) {
      if (this.past.size <= HISTORY_MAX) break;
      this.past.delete(number);
    }
    this.drawSoon();
  }

  // A flood is drawn a few times a second.
  drawSoon() {
    if (this.timer !== undefined) return;
    const wait = this.drawn + DRAW_MS - performance.now();
    if (wait <= 0) this.draw();
    else
      this.timer = setTimeout(() => {
        this.timer = undefined;
        this.draw();
      }, wait);
  }

  draw() {
    this.drawn = performance.now();
    const list = [...this.all.values()].sort((a, b) => rank(a) - rank(b) || b.last_s - a.last_s);
    this.open = list.filter(({ alarm }) => open(alarm)).length;
    this.count.hidden = !this.open;
    const alarms = trn("{n} alarm", "{n} alarms", this.open);
    this.count.textContent = `⚠ ${alarms}`;
    const wanted = this.filter.value.trim().toLowerCase();
    const found =
      this.view === "history"
        ? [...this.past.values()].reverse().map((one) => this.pastRow(one))
        : list.filter((n) => this.view === "all" || rank(n) < 99).map((n) => this.row(n));
    const rows = found.filter((row) => !wanted || (row.textContent ?? "").toLowerCase().includes(wanted));
    const shown = rows.slice(0, SHOWN_MAX);
    if (!shown.length) shown.push(this.note(this.empty(wanted)));
    if (rows.length > SHOWN_MAX)
      shown.push(this.note(tr("{count} more: use the filter", { count: rows.length - SHOWN_MAX })));
    this.replace(shown);
  }

  /** @param {string} wanted */
  empty(wanted) {
    if (wanted) return tr("nothing contains this text");
    return this.view === "all" ? tr("no events yet") : tr("no alarms");
  }

  /** @param {string} text */
  note(text) {
    return element("div", { role: "row", tabindex: -1 }, element("p", { role: "gridcell" }, text));
  }

  /**
   * Rows that have not changed keep their element. The tab stop stays with the cause that the person chose; before, it is
   * the first row, since in a flood the most urgent alarm may come after others.
   *
   * @param {HTMLElement[]} shown
   */
  replace(shown) {
    const focused = this.host.contains(document.activeElement);
    if (shown.length !== this.host.children.length || shown.some((row, i) => row !== this.host.children[i]))
      this.host.replaceChildren(...shown);
    const stop = (this.chosen && shown.find((row) => row.dataset.cause === this.chosen)) || shown[0];
    for (const row of shown) row.tabIndex = row === stop ? 0 : -1;
    if (focused && !this.host.contains(document.activeElement)) this.list.focus();
  }

  /**
   * @param {string} name
   * @param {object} of
   * @param {() => HTMLElement} make
   */
  cached(name, of, make) {
    const key = JSON.stringify(of),
      known = this.rows.get(name);
    if (known?.key === key) return known.row;
    const row = make();
    if (this.rows.size > 4 * HISTORY_MAX) this.rows.clear();
    this.rows.set(name, { key, row });
    return row;
  }

  /** @param {Notice} n */
  row(n) {
    const chattering = n.alarm !== null && chatters(n.alarm, this.nowS);
    const of = [n, this.may, this.waiting.has(n.cause), chattering];
    return this.cached(`n ${n.cause}`, of, () => noticeRow(n, this.nowS, this.may ? this.acts(n) : []));
  }

  /** @param {Transition} one */
  pastRow(one) {
    return this.cached(`h ${one.number}`, one, () => historyRow(one));
  }

  /** @param {Notice} notice */
  acts(notice) {
    const { alarm, cause, count, seen } = notice;
    if (!alarm || alarm.state === "normal") return [];
    const message = worded(notice.words);
    const acts = [];
    if (seen < count && open(alarm))
      acts.push({
        label:
          count > 1
            ? tr("Acknowledge all {count}: {message}", { count, message })
            : tr("Acknowledge: {message}", { message }),
        words: count - seen > 1 ? tr("Acknowledge {count}", { count: count - seen }) : tr("Acknowledge"),
        disabled: this.waiting.has(cause),
        act: () => this.acknowledge(cause),
      });
    const shelved = alarm.state === "shelved";
    acts.push({
      label: shelved ? tr("Unshelve: {message}", { message }) : tr("Shelve: {message}", { message }),
      words: shelved ? tr("Unshelve") : tr("Shelve"),
      act: () => this.shelve(cause),
    });
    return acts;
  }

  /**
   * @param {HTMLElement} row
   * @param {KeyboardEvent} event
   */
  key(row, event) {
    const cause = row.dataset.cause ?? "";
    if (event.key === "Enter" && event.target === row) this.go(row);
    else if (event.key.toLowerCase() === "k") this.acknowledge(cause, event.shiftKey);
    else if (event.key.toLowerCase() === "s") this.shelve(cause);
    else return false;
    return true;
  }

  /** @param {HTMLElement} row */
  go(row) {
    const { cause, time } = row.dataset;
    if (cause && time) this.onMoment(cause, Number(time));
  }

  /**
   * The notice of a cause that this person may act on.
   *
   * @param {string} cause
   */
  own(cause) {
    const notice = this.all.get(cause);
    return this.may && notice?.alarm && notice.alarm.state !== "normal" ? notice : undefined;
  }

  /**
   * All of a cause up to the event that is shown.
   *
   * @param {string} cause
   * @param {boolean} commenting
   */
  async acknowledge(cause, commenting = false) {
    const notice = this.own(cause);
    if (!notice || notice.seen >= notice.count || this.waiting.has(cause)) return;
    let answer = { by: storedName(), words: "" };
    if (!answer.by || commenting) {
      const given = await askPerson(tr("Acknowledge"), worded(notice.words), "comment");
      this.list.focus();
      if (!given) return;
      answer = given;
    }
    this.waiting.add(cause);
    this.draw();
    try {
      const { by, words: comment } = answer;
      await post("/api/acknowledge", { axis: this.axis, event: notice.id, by, comment });
    } catch (error) {
      this.waiting.delete(cause);
      this.onError(reason(error));
      this.draw();
    }
  }

  /**
   * Shelve an alarm, or unshelve it.
   *
   * @param {string} cause
   */
  async shelve(cause) {
    const notice = this.own(cause);
    if (!notice) return;
    const shelved = notice.alarm?.state === "shelved";
    const about = { axis: this.axis, event: notice.id };
    const title = shelved ? tr("Unshelve") : tr("Shelve");
    const known = shelved && storedName();
    const answer = known
      ? { by: known, words: "", minutes: 0 }
      : await askPerson(title, worded(notice.words), shelved ? "comment" : "reason");
    this.list.focus();
    if (!answer) return;
    const { by, words, minutes } = answer;
    try {
      if (shelved) await post("/api/unshelve", { ...about, by });
      else await post("/api/shelve", { ...about, by, reason: words, minutes });
    } catch (error) {
      this.onError(reason(error));
    }
  }
}
