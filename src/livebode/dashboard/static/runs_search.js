// @ts-check
// Which runs of the list a person looks for, and in which order.

/** @import { RunRow } from "./runs_feed.js" */

/** @param {string} text */
const plain = (text) => text.normalize("NFKC").toLowerCase();

/**
 * The words of a search: "…" is one word, and #… a whole tag.
 *
 * @param {string} text
 * @returns {string[]}
 */
export const words = (text) => [...plain(text).matchAll(/#?"[^"]*"?|\S+/g)].map(([word]) => word.replaceAll('"', ""));

/**
 * How a tag is written in a search.
 *
 * @param {string} tag
 */
export const tagWord = (tag) => (/[\s"]/.test(tag) ? `#"${tag.replaceAll('"', "")}"` : `#${tag}`);

/**
 * Whether a run has all words of a search.
 *
 * @param {RunRow} run
 * @param {string[]} wanted
 * @param {string[]} more texts that are shown for it
 */
export function found(run, wanted, more = []) {
  const tags = run.tags.map((tag) => plain(tag).replaceAll('"', ""));
  const text = plain(
    [run.name, run.notes, run.machine, run.recording, run.signals, run.words, run.estimator, run.model, ...more].join(
      "\n",
    ),
  );
  return wanted.every((word) =>
    word.startsWith("#") && word.length > 1
      ? tags.some((tag) => tag === word.slice(1))
      : text.includes(word) || tags.some((tag) => tag.includes(word)),
  );
}

/**
 * When a run began; where that is not known, when it was written.
 *
 * @param {RunRow} run
 */
export const since = (run) => run.begun ?? run.written ?? 0;

const TONES = ["alarm", "check", "open", "ok"];

/** @type {Record<string, (run: RunRow) => string | number>} */
const KEYS = {
  name: (run) => run.name,
  begun: since,
  duration: (run) => run.duration_s ?? -1,
  machine: (run) => run.machine || run.recording,
  lines: (run) => run.lines,
  verdict: (run) => -TONES.indexOf(run.tone),
  size: (run) => run.size_bytes,
};
export const ORDERS = Object.keys(KEYS);
const collator = new Intl.Collator(undefined, { numeric: true });

/**
 * @param {RunRow[]} runs
 * @param {string} by
 * @param {boolean} down
 */
export function ordered(runs, by, down) {
  const key = KEYS[by] ?? KEYS.begun,
    sign = down ? -1 : 1;
  return runs.toSorted((a, b) => {
    const [x, y] = [key(a), key(b)];
    const order = typeof x === "string" ? collator.compare(x, String(y)) : x - Number(y);
    return sign * order || collator.compare(a.name, b.name);
  });
}
