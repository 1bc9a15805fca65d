// @ts-check
// On the page of a run that was started in the browser: a button that ends the measurement, which is complete then.
import { tr } from "./language.js";
import { reason, refusal } from "./link.js";
import { element } from "./make.js";

/** @import { Addition } from "./messages.js" */
/** @import { Job } from "./job_progress.js" */

const EVERY_MS = 2000;

/** @type {Addition} */
export const addition = (_page, _bode, { complain }) => {
  const run = /^\/run\/([^/]+)\//.exec(location.pathname)?.[1],
    button = element("button", { type: "button", id: "finish", class: "primary", hidden: true }, tr("Finish"));
  button.title = tr("End the measurement; the run is complete then");
  let job = "";

  async function look() {
    // Only the page of all runs has jobs, and only where this run is one of many.
    const answer = await fetch("/api/tasks");
    if (!answer.ok) return false;
    const { jobs, role } = /** @type {{jobs: Job[], role: string}} */ (await answer.json());
    const own = jobs.find(
      ({ task, arguments: words, ended }) =>
        task === "measure" && !ended && words.includes(`--out=${decodeURIComponent(run ?? "")}`),
    );
    button.hidden = !own || role !== "operator";
    if (!own) return false;
    job = own.id;
    if (own.state === "stopping") stopping();
    return true;
  }

  function stopping() {
    button.disabled = true;
    button.textContent = tr("finishing …");
  }

  button.addEventListener("click", async () => {
    stopping();
    try {
      const answer = await fetch("/api/cancel", {
        method: "POST",
        headers: { "content-type": "application/json" },
        body: JSON.stringify({ job }),
      });
      if (!answer.ok) throw await refusal(answer);
    } catch (error) {
      complain(reason(error));
      button.disabled = false;
      button.textContent = tr("Finish");
    }
  });

  async function follow() {
    if (await look().catch(() => !button.hidden)) setTimeout(follow, EVERY_MS);
  }

  if (run) {
    document.querySelector(".top > .fold")?.before(button);
    follow();
  }
  return { begin() {}, draw() {} };
};
