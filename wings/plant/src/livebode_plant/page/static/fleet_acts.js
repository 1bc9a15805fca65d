// @ts-check
// What a person does with the alarm of an axis: acknowledge, shelve, unshelve.
import { STATES } from "./alarmrows.js";
import { hourMinute } from "./clock.js";
import { kindWords } from "./fleet_words.js";
import { tr } from "./language.js";
import { post, reason } from "./link.js";
import { element } from "./make.js";
import { askPerson, storedName } from "./person.js";

/** @import { AxisRow, FleetFeed } from "./fleet_feed.js" */

/** @param {AxisRow} row */
export const open = ({ state }) => state === "unacknowledged" || state === "returned";

/** @param {AxisRow} row */
export function chip({ state, priority }) {
  const [sign, words] = STATES[state];
  /** @type {Record<string, string>} */
  const priorities = { high: tr("high priority"), medium: tr("medium priority"), low: tr("low priority") };
  const text = [`${sign} ${words}`, priorities[priority]].filter(Boolean).join(" · ");
  return element("span", { class: `state ${state} ${priority}` }, text);
}

/** @param {AxisRow} row @returns {string[]} who acted, and why */
export function persons({ by, comment, shelf }) {
  const found = by ? [tr("acknowledged by {name}", { name: by }) + (comment ? `: ${comment}` : "")] : [];
  if (shelf)
    found.push(
      tr("shelved by {name} until {time}: {reason}", {
        name: shelf.by,
        time: hourMinute(shelf.until_s),
        reason: shelf.reason,
      }),
    );
  return found;
}

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
    /** @param {string} label @param {string} words @param {() => void} act @param {boolean} disabled */
    const button = (label, words, act, disabled = false) =>
      element(
        "button",
        {
          type: "button",
          tabindex,
          "aria-label": label,
          disabled,
          onclick: (event) => {
            event.stopPropagation();
            act();
          },
        },
        words,
      );
    return [
      ...(open(row)
        ? [
            button(
              tr("Acknowledge: {message}", { message }),
              tr("Acknowledge"),
              () => this.acknowledge(row, after),
              this.waiting.has(this.key(row)),
            ),
          ]
        : []),
      button(
        shelved ? tr("Unshelve: {message}", { message }) : tr("Shelve: {message}", { message }),
        shelved ? tr("Unshelve") : tr("Shelve"),
        () => this.shelve(row, after),
      ),
    ];
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
