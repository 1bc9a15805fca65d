// @ts-check
// What a person does with the alarm of an axis: acknowledge, shelve, unshelve.
import { actButton, open } from "./alarmrows.js";
import { kindWords } from "./fleet_words.js";
import { tr } from "./language.js";
import { post, reason } from "./link.js";
import { askPerson, storedName } from "./person.js";

/** @import { AxisRow, FleetFeed } from "./fleet_feed.js" */

export class Acts {
  /**
   * @param {FleetFeed} feed
   * @param {(text: string) => void} onError
   */
  constructor(feed, onError) {
    this.feed = feed;
    this.onError = onError;
    /** @type {Set<string>} axes and counts whose acknowledgement is on its way */
    this.waiting = new Set();
  }

  get may() {
    return this.feed.fleet?.role === "operator";
  }

  /** @param {AxisRow} row */
  text(row) {
    return [this.feed.paths[row.axis], kindWords(row.kind)].filter(Boolean).join(": ");
  }

  /**
   * @param {AxisRow} row
   * @param {() => void} after the focus returns
   */
  buttons(row, after, tabindex = -1) {
    if (!this.may || row.state === "normal" || !row.raised) return [];
    const message = this.text(row),
      shelved = row.state === "shelved";
    const acts = [
      {
        label: shelved ? tr("Unshelve: {message}", { message }) : tr("Shelve: {message}", { message }),
        words: shelved ? tr("Unshelve") : tr("Shelve"),
        act: () => this.shelve(row, after),
      },
    ];
    const acknowledge = {
      label: tr("Acknowledge: {message}", { message }),
      words: tr("Acknowledge"),
      act: () => this.acknowledge(row, after),
      disabled: this.waiting.has(this.key(row)),
    };
    return [...(open(row) ? [acknowledge] : []), ...acts].map((act) => actButton(act, tabindex));
  }

  /** @param {AxisRow} row */
  key(row) {
    return `${this.feed.paths[row.axis]} ${row.raised}`;
  }

  /**
   * @param {AxisRow} row
   * @param {() => void} after
   * @param {boolean} commenting
   */
  async acknowledge(row, after, commenting = false) {
    if (!this.may || !open(row)) return;
    let answer = { by: storedName(), words: "" };
    if (!answer.by || commenting) {
      const given = await askPerson(tr("Acknowledge"), this.text(row), "comment");
      after();
      if (!given) return;
      answer = given;
    }
    this.waiting.add(this.key(row));
    await this.send("/api/acknowledge", row, { by: answer.by, comment: answer.words });
    this.waiting.delete(this.key(row));
    after();
  }

  /**
   * Shelve an alarm, or unshelve it.
   *
   * @param {AxisRow} row
   * @param {() => void} after
   */
  async shelve(row, after) {
    if (!this.may || row.state === "normal" || !row.raised) return;
    const shelved = row.state === "shelved",
      known = shelved && storedName();
    const answer = known
      ? { by: known, words: "", minutes: 0 }
      : await askPerson(shelved ? tr("Unshelve") : tr("Shelve"), this.text(row), shelved ? "comment" : "reason");
    after();
    if (!answer) return;
    const { by, words, minutes } = answer;
    if (shelved) await this.send("/api/unshelve", row, { by });
    else await this.send("/api/shelve", row, { by, reason: words, minutes });
  }

  /** @param {string} path @param {AxisRow} row @param {object} what */
  async send(path, row, what) {
    try {
      await post(path, { axis: row.axis, event: `${this.feed.fleet?.layout}:${row.raised}`, ...what });
    } catch (error) {
      this.onError(reason(error));
    }
  }
}
