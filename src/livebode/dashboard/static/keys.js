// @ts-check
// The keyboard and its help.
import { tr } from "./language.js";
import { element } from "./make.js";

/** @typedef {() => void} Act */
/** @typedef {[keys: string[], words: string, act: Act | null]} Action Without `act`, each key has its own. */

/** What is printed on a key. @type {Record<string, string>} */
const NAMES = { " ": tr("Space"), PageUp: tr("Page Up"), PageDown: tr("Page Down") };

/**
 * Whether the element with the focus uses a key itself.
 *
 * @param {EventTarget | null} focus
 * @param {string} key
 */
function uses(focus, key) {
  if (!(focus instanceof Element)) return false;
  const { tagName } = focus,
    type = focus.getAttribute("type");
  if (tagName === "INPUT" && type === "range") return key.startsWith("Arrow");
  if (tagName === "INPUT" && type === "checkbox") return key === " ";
  if (tagName === "BUTTON" || tagName === "SUMMARY") return key === " " || key === "Enter";
  if (tagName === "A") return key === "Enter";
  return tagName === "INPUT" || tagName === "SELECT";
}

/**
 * @param {HTMLElement} list
 * @param {Action[]} actions
 * @param {Record<string, Act>} each the action of a key that shares its words with others
 */
export function keys(list, actions, each) {
  list.replaceChildren(
    ...actions.flatMap(([names, words]) => [
      element("dt", {}, ...names.flatMap((n) => [element("kbd", {}, NAMES[n] ?? n), " "])),
      element("dd", {}, words),
    ]),
  );
  /** @type {Record<string, string>} */
  const real = { "←": "ArrowLeft", "→": "ArrowRight" };
  const known = new Map(
    actions.flatMap(([names, , act]) => names.map((name) => [real[name] || name, act || each[name]])),
  );
  document.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    if (uses(event.target, event.key)) return;
    const act = known.get(event.key) || (event.key.length === 1 && known.get(event.key.toUpperCase()));
    if (!act) return;
    event.preventDefault();
    act();
  });
}
