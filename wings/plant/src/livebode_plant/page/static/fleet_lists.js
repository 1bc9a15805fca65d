// @ts-check
// Lists beside the tiles: the worst axes, alarms, workers, gaps. One tab stop each.
import { chosen, remember } from "./address.js";
import { chip, persons } from "./alarmrows.js";
import { Rows } from "./fleet_rows.js";
import { LOOKS, remarks, since, span, thousands } from "./fleet_words.js";
import { tr, trn } from "./language.js";
import { choose, element, segments } from "./make.js";

/** @import { Acts } from "./fleet_acts.js" */
/** @import { AxisRow, FleetFeed, News, Silent, Worker, Workers } from "./fleet_feed.js" */
/** @import { Row } from "./fleet_rows.js" */
/** @typedef {"worst" | "alarms" | "workers" | "gaps"} List */

/** @type {[value: List, text: string][]} */
const LISTS = [
  ["worst", tr("worst")],
  ["alarms", tr("alarms")],
  ["workers", tr("workers")],
  ["gaps", tr("gaps")],
];

export class Lists {
  /** @type {News} */
  news = {};
  /** @type {Map<string, AxisRow>} */
  known = new Map();

  /**
   * @param {{host: HTMLElement, views: HTMLElement, summary: HTMLElement}} parts
   * @param {FleetFeed} feed
   * @param {Acts} acts
   * @param {(axis: number) => void} onOpen
   */
  constructor({ host, views, summary }, feed, acts, onOpen) {
    this.views = views;
    this.summary = summary;
    this.feed = feed;
    this.acts = acts;
    this.onOpen = onOpen;
    this.rows = new Rows(host, (name, event, row) => this.key(name, event, row));
    host.addEventListener("click", ({ target }) => {
      const row = target instanceof Element && target.closest("[data-row]");
      if (row instanceof HTMLElement) this.go(row.dataset.row ?? "");
    });
    /** @type {List} */
    this.list = chosen(
      "list",
      "worst",
      LISTS.map(([value]) => value),
    );
    segments(
      views,
      LISTS.map(([value, text]) => ({ value, text })),
      this.list,
      (value) => this.show(value),
    );
    feed.watched.list = this.list;
  }

  /** @param {List} list */
  show(list) {
    this.list = list;
    choose(this.views, list);
    remember("list", list, "worst");
    this.feed.watch({ list });
    this.draw();
  }

  /** @param {News} news */
  take(news) {
    this.news = { ...this.news, ...news };
    const label = this.views.querySelector('[data-value="alarms"]');
    const count = this.news.open ?? 0;
    if (label) label.textContent = count ? `${tr("alarms")} ⚠ ${thousands(count)}` : tr("alarms");
    this.draw();
  }

  draw() {
    const { worst, alarms, gaps, workers } = this.news;
    if (this.list === "worst") this.axes(worst, (row) => this.worst(row), tr("All axes are in order."), "");
    else if (this.list === "alarms") {
      const text = alarms
        ? trn("{n} alarm is active or not acknowledged.", "{n} alarms are active or not acknowledged.", alarms.count)
        : "";
      this.axes(alarms?.rows, (row) => this.alarm(row), tr("no alarms"), text);
    } else if (this.list === "gaps") {
      const text = gaps
        ? tr("{lost} samples lost in {gaps} gaps, at {axes} axes.", {
            lost: thousands(gaps.lost),
            gaps: thousands(gaps.gaps),
            axes: thousands(gaps.axes),
          })
        : "";
      this.axes(gaps?.rows, (row) => this.gap(row), tr("No samples were lost."), text);
    } else this.workers(workers);
  }

  /**
   * @param {AxisRow[] | undefined} rows
   * @param {(row: AxisRow) => Row} make
   * @param {string} none
   * @param {string} text
   */
  axes(rows, make, none, text) {
    this.known = new Map((rows ?? []).map((row) => [this.feed.paths[row.axis], row]));
    this.summary.textContent = text;
    this.rows.draw(rows?.length ? rows.map(make) : [note(rows ? none : tr("reading …"))]);
  }

  /** @param {AxisRow} row @returns {Row} */
  worst(row) {
    const { sign, words, key } = LOOKS[row.look],
      path = this.feed.paths[row.axis];
    const text = remarks(row).join(" · ");
    return {
      name: path,
      of: [row.look, text, row.raised_s],
      make: () => this.row(path, key, `${sign} ${words}`, text, since(row.raised_s), []),
    };
  }

  /** @param {AxisRow} row @returns {Row} */
  alarm(row) {
    const path = this.feed.paths[row.axis];
    const text = [...remarks(row), ...persons(row)].join(" · ");
    const { key } = LOOKS[row.look];
    const of = [row.state, row.raised, row.priority, text, this.acts.may, this.acts.waiting.has(this.acts.key(row))];
    const after = () => this.rows.list.focus();
    return {
      name: path,
      of,
      make: () => this.row(path, key, chip(row), text, since(row.raised_s), this.acts.buttons(row, after)),
    };
  }

  /** @param {AxisRow} row @returns {Row} */
  gap(row) {
    const path = this.feed.paths[row.axis],
      { key } = LOOKS[row.look];
    const text = trn("{lost} samples in {n} gap", "{lost} samples in {n} gaps", row.gaps, {
      lost: thousands(row.lost),
    });
    return { name: path, of: [text, row.look], make: () => this.row(path, key, "", text, "", []) };
  }

  /**
   * @param {string} path
   * @param {string} key of its look
   * @param {string | HTMLElement} state
   * @param {string} text
   * @param {string} time
   * @param {HTMLElement[]} acts
   */
  row(path, key, state, text, time, acts) {
    const cut = path.lastIndexOf("/") + 1;
    const mark = state ? [element("span", { class: "look" }, state), " "] : [];
    const name = element("span", { class: "path" }, path.slice(0, cut), element("b", {}, path.slice(cut)));
    return element(
      "div",
      { role: "row", tabindex: -1, class: `look-${key}` },
      element("div", { role: "gridcell", class: "what" }, name, ...mark, text),
      element("time", { role: "gridcell" }, time),
      ...(acts.length ? [element("span", { role: "gridcell", class: "acts" }, ...acts)] : []),
    );
  }

  /** @param {Workers | undefined} workers */
  workers(workers) {
    this.known.clear();
    if (!workers) {
      this.summary.textContent = "";
      this.rows.draw([note(tr("reading …"))]);
      return;
    }
    const parts = [
      trn("{n} worker", "{n} workers", workers.count),
      trn("{n} partition", "{n} partitions", workers.partitions),
      tr("{count} messages wait", { count: thousands(workers.waiting) }),
    ];
    if (workers.silent_count)
      parts.push(trn("{n} partition without worker", "{n} partitions without worker", workers.silent_count));
    if (workers.dropped) parts.push(tr("{count} messages rejected", { count: thousands(workers.dropped) }));
    this.summary.textContent = parts.join(" · ");
    this.rows.draw([...workers.silent.map(silentRow), ...workers.rows.map(workerRow)]);
  }

  /** @param {string} path */
  go(path) {
    const row = this.known.get(path);
    if (row) this.onOpen(row.axis);
  }

  /** @param {string} path @param {KeyboardEvent} event @param {HTMLElement} element */
  key(path, event, element) {
    const row = this.known.get(path),
      after = () => this.rows.list.focus();
    if (!row) return false;
    if (event.key === "Enter" && event.target === element) this.onOpen(row.axis);
    else if (this.list !== "alarms") return false;
    else if (event.key.toLowerCase() === "k") this.acts.acknowledge(row, after, event.shiftKey);
    else if (event.key.toLowerCase() === "s") this.acts.shelve(row, after);
    else return false;
    return true;
  }
}

/** @param {string} text @returns {Row} */
const note = (text) => ({
  name: "",
  of: text,
  make: () => element("div", { role: "row", tabindex: -1 }, element("p", { role: "gridcell" }, text)),
});

/** @param {string} name @param {string} key @param {string} state @param {string} text @returns {Row} */
const plainRow = (name, key, state, text) => ({
  name,
  of: [state, text],
  make: () =>
    element(
      "div",
      { role: "row", tabindex: -1, class: `look-${key}` },
      element(
        "div",
        { role: "gridcell", class: "what" },
        element("span", { class: "path" }, element("b", {}, name)),
        element("span", { class: "look" }, state),
        " ",
        text,
      ),
    ),
});

/** @param {Silent} silent */
function silentRow({ partition, axes, age_s: ageS }) {
  const { sign, words, key } = LOOKS[10];
  const heard = ageS === null ? tr("never heard") : tr("last heard {time} ago", { time: span(ageS) });
  const text = [tr("{count} axes", { count: thousands(axes) }), heard].join(" · ");
  return plainRow(tr("partition {number}", { number: partition }), key, `${sign} ${words}`, text);
}

/** @param {Worker} worker */
function workerRow({ worker, partitions, axes, waiting, lag_s: lagS }) {
  const { sign, key } = LOOKS[lagS > 2 ? 9 : 1];
  const lag = tr("lag {time}", { time: span(lagS) });
  const text = [
    tr("{count} messages wait", { count: thousands(waiting) }),
    trn("{n} partition", "{n} partitions", partitions),
    tr("{count} axes", { count: thousands(axes) }),
  ].join(" · ");
  return plainRow(worker || tr("unknown worker"), key, `${sign} ${lag}`, text);
}
