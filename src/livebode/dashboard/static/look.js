// @ts-check
// The verdict at the top of the page: large if a person must act, else beside the result; a screen reader hears it when its meaning changes, not every second.
import { byId as $ } from "./make.js";
import { sentence } from "./verdict.js";

/** @import { Page, Verdict } from "./messages.js" */

/** @type {Record<string, string>} */
export const SIGNS = { alarm: "⚠", check: "◆", ok: "✓", open: "○" };

let heard = "";

/**
 * @param {Page} page
 * @returns {Verdict | undefined}
 */
const verdictOf = ({ facts, health, verdicts }) => (facts && health ? health.verdict : verdicts[facts?.axis ?? 0]);

/**
 * @param {Page} page
 * @param {boolean} current whether what the page knows is the state of the run: the server answers, or both have ended
 */
export function firstLook(page, current) {
  const verdict = verdictOf(page);
  const { text, tone, detail } = sentence(current, verdict);
  const host = $("verdict");
  const shown = `${SIGNS[tone]} ${text}`;
  if (host.textContent !== shown) host.textContent = shown;
  host.className = `first-look ${tone}`;
  $("headline").className = `headline ${tone}`;
  host.title = detail;
  const meaning = current ? `${verdict?.word} ${verdict?.cause}` : "";
  if (meaning === heard) return;
  heard = meaning;
  $("verdict-heard").textContent = text;
}
