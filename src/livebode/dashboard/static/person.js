// @ts-check
// Who acts: the name is asked for once and stored in this browser; comment, reason and duration each time.
import { tr, trn } from "./language.js";
import { element } from "./make.js";

/** @typedef {{by: string, words: string, minutes: number}} Answer */

const NAME_MAX = 60,
  TEXT_MAX = 200;
const MINUTES = [10, 60, 8 * 60, 24 * 60];

export function storedName() {
  try {
    return localStorage.person || "";
  } catch {
    return ""; // a browser that stores nothing
  }
}

/** @param {string} name */
function store(name) {
  try {
    localStorage.person = name;
  } catch {
    /* it is asked for again */
  }
}

/** @param {number} minutes */
const duration = (minutes) =>
  minutes < 60 ? trn("{n} minute", "{n} minutes", minutes) : trn("{n} hour", "{n} hours", Math.round(minutes / 60));

/**
 * Ask in a dialog; null if the person cancels.
 *
 * @param {string} title
 * @param {string} message of the alarm
 * @param {"comment" | "reason"} words what is asked for; a reason is necessary, and has a duration
 * @returns {Promise<Answer | null>}
 */
export function askPerson(title, message, words) {
  const reason = words === "reason";
  const name = element("input", { required: true, maxlength: NAME_MAX, autocomplete: "name", value: storedName() });
  const text = element("input", { required: reason, maxlength: TEXT_MAX, autocomplete: "off" });
  const minutes = element("select", {}, ...MINUTES.map((value) => element("option", { value }, duration(value))));
  minutes.value = "60";
  const dialog = element(
    "dialog",
    { class: "person", "aria-label": title },
    element(
      "form",
      { method: "dialog" },
      element("h2", {}, title),
      element("p", {}, message),
      element("label", {}, tr("Your name"), name),
      element("label", {}, reason ? tr("Reason") : tr("Comment (optional)"), text),
      ...(reason ? [element("label", {}, tr("For"), minutes)] : []),
      element(
        "p",
        { class: "answers" },
        element("button", { type: "button", onclick: () => dialog.close("") }, tr("Cancel")),
        element("button", { type: "submit", class: "primary", value: "yes" }, title),
      ),
    ),
  );
  document.body.append(dialog);
  dialog.showModal();
  (name.value ? text : name).focus();
  return new Promise((answer) => {
    dialog.addEventListener("close", () => {
      dialog.remove();
      const by = name.value.trim();
      if (dialog.returnValue !== "yes" || !by) {
        answer(null);
        return;
      }
      store(by);
      answer({ by, words: text.value.trim(), minutes: Number(minutes.value) });
    });
  });
}
