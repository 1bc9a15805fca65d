// @ts-check
// The dialogs of the list: tags and notes of a run, and its deletion.
import { tr } from "./language.js";
import { post, reason } from "./link.js";
import { byId as $ } from "./make.js";
import { size } from "./runs_words.js";

/** @import { RunRow } from "./runs_feed.js" */

const notes = $("notes", HTMLDialogElement),
  tags = $("notes-tags", HTMLInputElement),
  text = $("notes-text", HTMLTextAreaElement),
  deletion = $("deletion", HTMLDialogElement),
  confirmed = $("deletion-name", HTMLInputElement),
  confirm = $("deletion-confirm", HTMLButtonElement);
let edited = "",
  doomed = "";

/** @param {() => void} onChange */
export function dialogs(onChange) {
  for (const dialog of [notes, deletion])
    for (const button of dialog.querySelectorAll("[data-close]"))
      button.addEventListener("click", () => dialog.close());
  $("notes-form").addEventListener("submit", async (event) => {
    event.preventDefault();
    const list = tags.value.split(/[,，、]/).map((tag) => tag.trim());
    const answer = await tried(
      "/api/notes",
      { run: edited, tags: list.filter(Boolean), text: text.value },
      "notes-wrong",
    );
    if (!answer) return;
    notes.close();
    onChange();
  });
  confirmed.addEventListener("input", () => {
    confirm.disabled = confirmed.value !== doomed;
  });
  $("deletion-form").addEventListener("submit", async (event) => {
    event.preventDefault();
    if (confirm.disabled) return;
    confirm.disabled = true;
    if (!(await tried("/api/delete", { run: doomed, confirmed: confirmed.value }, "deletion-wrong"))) return;
    deletion.close();
    onChange();
  });
}

/**
 * @param {string} path
 * @param {object} body
 * @param {string} place where a refusal is shown
 */
async function tried(path, body, place) {
  try {
    await post(path, body);
    return true;
  } catch (error) {
    $(place).textContent = reason(error);
    return false;
  }
}

/** @param {RunRow} run */
export function editNotes(run) {
  edited = run.name;
  $("notes-title").textContent = tr("Tags and notes: {run}", { run: run.name });
  tags.value = run.tags.join(", ");
  text.value = run.notes;
  $("notes-wrong").textContent = "";
  notes.showModal();
}

/**
 * @param {RunRow} run
 * @param {string} directory
 */
export function askDeletion(run, directory) {
  doomed = run.name;
  $("deletion-what").textContent = tr(
    "The run “{run}” with all its files ({size}) is moved to {place}. There it can be restored; its space on the disk is free when it is removed there.",
    { run: run.name, size: size(run.size_bytes), place: `${directory}/.deleted` },
  );
  $("deletion-label").textContent = tr("To confirm, enter the name of the run: {run}", { run: run.name });
  confirmed.value = "";
  confirm.disabled = true;
  $("deletion-wrong").textContent = "";
  deletion.showModal();
}
