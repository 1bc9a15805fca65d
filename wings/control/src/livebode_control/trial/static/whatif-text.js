// @ts-check
// A trial as text for a person to copy: keys of the configuration, or the filters as coefficients.
import { numeral, tr } from "./language.js";
import { biquadsOf } from "./trial.js";
import { worded } from "./worded.js";
import { plain } from "./words.js";

/** @import { LoopFacts } from "./loop.js" */
/** @import { Trial } from "./trial.js" */

/**
 * The filters as `livebode tune --json` has them.
 *
 * @param {LoopFacts} facts
 * @param {Trial} trial
 */
export const filtersText = ({ rate_hz }, trial) =>
  `${JSON.stringify(
    biquadsOf(trial, rate_hz).map(({ b, a }) => ({ rate_hz, b, a: [1, ...a] })),
    null,
    2,
  )}\n`;

/** The described keys with their values under [loop], and the filters as comments. @param {LoopFacts} facts @param {Trial} trial */
export function tomlText(facts, trial) {
  const lines = [`# what if; nothing was written to a machine; loop check: ${facts.verdict}`];
  const values = { ...facts.values, ...trial.values };
  let table = "";
  for (const [name, key] of Object.entries(facts.tables)) {
    if (!(name in values)) continue;
    const cut = key.lastIndexOf(".");
    if (key.slice(0, cut) !== table) {
      table = key.slice(0, cut);
      lines.push(`[${table}]`);
    }
    lines.push(`${key.slice(cut + 1)} = ${values[name]}`);
  }
  if (!facts.described) lines.push(`# factor on the measured loop: ${values.gain}`);
  const biquads = biquadsOf(trial, facts.rate_hz);
  if (biquads.length)
    lines.push(`# filters in series at ${facts.rate_hz} Hz: y = b0 x + b1 x1 + b2 x2 - a1 y1 - a2 y2`);
  for (const [i, { b, a }] of biquads.entries()) {
    const notch = trial.notches[i];
    lines.push(
      notch
        ? `# notch at ${notch.hz} Hz, ${notch.depthDb} dB, damping ${notch.damping}`
        : `# low-pass of second order at ${trial.lowPassHz} Hz`,
      `#   b = [${b.join(", ")}], a = [1, ${a.join(", ")}]`,
    );
  }
  if (trial.delayMs) lines.push(`# additional delay: ${trial.delayMs} ms`);
  return `${lines.join("\n")}\n`;
}

/** What was found by `livebode validate --loop`, for a person. @param {LoopFacts} facts @returns {[tone: "good" | "bad" | "open", words: string]} */
export function checkWords({ described, verdict, sentence }) {
  if (!described) return ["open", tr("The loop is not described: these values are not promises.")];
  if (verdict === "as described") return ["good", tr("loop check: as described")];
  if (verdict === "not checked")
    return [
      "open",
      tr(
        "loop check: not checked. These values are not promises: compare the description with the signals by livebode validate --loop.",
      ),
    ];
  return ["bad", tr("loop check: contradicted. These values are wrong: {sentence}", { sentence: worded(sentence) })];
}

/** With as many digits at any time, so that a table does not move while a slider does. @param {number} value */
export function orNoLimit(value, digits = 3) {
  if (!Number.isFinite(value)) return tr("no limit");
  return value >= 1e-2 && value < 10 ** digits ? numeral(value.toPrecision(digits)) : plain(value, digits);
}
