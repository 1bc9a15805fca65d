// @ts-check
// A job until it has ended: asked for again several times a second.
import { tr } from "./language.js";
import { post, reason } from "./link.js";
import { element } from "./make.js";
import { json } from "./runs_feed.js";

/**
 * @typedef {object} Job What the server tells of a job; see jobs.py.
 * @property {string} id
 * @property {string} task
 * @property {"running" | "stopping" | "done" | "failed" | "stopped"} state
 * @property {number} begun seconds since 1970
 * @property {number | null} ended
 * @property {number | null} progress percent
 * @property {number | null} code
 * @property {string[]} arguments
 * @property {string} sentence
 * @property {string} output
 */

const EVERY_MS = 250;

/**
 * Show how far a job is, with a button to cancel it, until it has ended.
 *
 * @param {HTMLElement} host is emptied
 * @param {string} id
 * @param {string} doing what the job does, as "Measuring …"
 * @returns {Promise<Job>} the job that has ended
 */
export async function followJob(host, id, doing) {
  const bar = element("progress", { max: 100, "aria-label": doing }),
    words = element("span", { role: "status" }, doing),
    cancel = element("button", { type: "button" }, tr("Cancel"));
  cancel.addEventListener("click", () => {
    cancel.disabled = true;
    post("/api/cancel", { job: id }).catch((error) => {
      words.textContent = reason(error);
    });
  });
  host.replaceChildren(element("div", { class: "job" }, words, bar, cancel));
  for (;;) {
    /** @type {Job} */
    const job = await json("/api/job", { id });
    if (job.ended !== null) return job;
    if (job.progress !== null) {
      bar.value = job.progress;
      words.textContent = `${doing} ${job.progress} %`;
    }
    if (job.state === "stopping") words.textContent = tr("stopping …");
    await new Promise((done) => setTimeout(done, EVERY_MS));
  }
}
