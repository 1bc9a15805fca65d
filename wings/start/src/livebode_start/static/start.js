// @ts-check
// Above the list of runs: a place to drop a recording, and those that are in the directory.
import { tr } from "./language.js";
import { reason, refused } from "./link.js";
import { addressForm } from "./live_source.js";
import { element } from "./make.js";
import { json } from "./runs_feed.js";
import { size } from "./runs_words.js";
import { taskBar } from "./task_bar.js";

/** @import { Workspace } from "./messages.js" */
/** @typedef {{name: string, size_bytes: number, written: number}} Recording */

const SHOWN = 6,
  NAME_MAX = 120;

/** @param {string} name */
const measuring = (name) => `/measure?${new URLSearchParams({ recording: name })}`;

/** @type {Workspace} */
export const workspace = (place) => {
  const input = element("input", { type: "file", id: "file", class: "unseen" }),
    status = element("p", { class: "wrong", role: "alert" }),
    bar = element("progress", { max: 1, hidden: true, "aria-label": tr("Sending the recording") }),
    list = element("ul", { class: "recordings" }),
    more = element("button", { type: "button", hidden: true }),
    hint = element("small", { id: "limit" });
  const drop = element(
    "label",
    { for: "file", class: "drop" },
    element("b", {}, tr("Drop a recording here")),
    element("span", { class: "button primary" }, tr("Choose a file")),
    hint,
    bar,
  );
  const here = element(
    "div",
    { class: "here", hidden: true },
    element("h3", {}, tr("or a recording that is here")),
    list,
    more,
  );
  const card = element(
    "section",
    { class: "card start", "aria-labelledby": "start-title", hidden: true },
    element("h2", { id: "start-title" }, tr("Measure: from a recording or a live source to its Bode plot")),
    input,
    drop,
    status,
    addressForm(measuring),
    here,
  );
  place.append(card);
  const tasks = taskBar(place);

  /** @param {File} file */
  async function send(file) {
    status.textContent = "";
    try {
      location.assign(measuring(await uploaded(file, bar)));
    } catch (error) {
      status.textContent = reason(error);
    } finally {
      bar.hidden = true;
      input.value = "";
    }
  }

  async function look() {
    const { recordings, bytes_max: most } = await json("/api/recordings", {});
    hint.textContent = tr("CSV, MAT, HDF5, TDMS, MDF, Parquet, WAV and others; at most {size}", { size: size(most) });
    here.hidden = !recordings.length;
    const rows = recordings.map((/** @type {Recording} */ { name, size_bytes: bytes }) =>
      element("li", {}, element("a", { href: measuring(name) }, name), element("small", {}, size(bytes))),
    );
    list.replaceChildren(...rows.slice(0, SHOWN));
    more.hidden = rows.length <= SHOWN;
    more.textContent = tr("Show all {count}", { count: rows.length });
    more.onclick = () => {
      list.replaceChildren(...rows);
      more.hidden = true;
    };
  }

  input.addEventListener("change", () => input.files?.[0] && send(input.files[0]));
  addEventListener("dragover", (event) => {
    if (card.hidden || !event.dataTransfer?.types.includes("Files")) return;
    event.preventDefault();
    drop.classList.add("over");
  });
  addEventListener("dragleave", (event) => {
    if (!event.relatedTarget) drop.classList.remove("over");
  });
  addEventListener("drop", (event) => {
    const file = event.dataTransfer?.files[0];
    if (card.hidden || !file) return;
    event.preventDefault();
    drop.classList.remove("over");
    send(file);
  });
  let looked = false;
  return (all) => {
    const { role, runs } = all;
    tasks(all);
    card.hidden = role !== "operator";
    document.body.classList.toggle("no-runs", !card.hidden && !runs.size);
    if (card.hidden || looked) return;
    looked = true;
    look().catch((error) => {
      status.textContent = reason(error);
    });
  };
};

/**
 * Send a file; the name that it has there.
 *
 * @param {File} file
 * @param {HTMLProgressElement} bar
 * @returns {Promise<string>}
 */
function uploaded(file, bar) {
  const request = new XMLHttpRequest();
  request.open("POST", `/api/upload?${new URLSearchParams({ name: file.name.slice(-NAME_MAX) })}`);
  request.responseType = "text";
  bar.hidden = false;
  bar.removeAttribute("value");
  request.upload.addEventListener("progress", ({ loaded, total }) => {
    bar.value = loaded / Math.max(1, total);
  });
  return new Promise((resolve, reject) => {
    request.addEventListener("error", () => reject(new Error(tr("The server does not answer."))));
    request.addEventListener("load", () => {
      if (request.status === 200) resolve(JSON.parse(request.responseText).recording);
      else reject(new Error(refused(request.status, request.responseText)));
    });
    request.send(file);
  });
}
