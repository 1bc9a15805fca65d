// @ts-check
// Above the list of runs: what can be done with those that are chosen, and the jobs that run.
import { tr } from "./language.js";
import { element } from "./make.js";
import { json } from "./runs_feed.js";
import { TASKS } from "./task_words.js";

/** @import { Workspace } from "./messages.js" */
/** @import { Job } from "./job_progress.js" */

const EVERY_MS = 3000;
const JOBS = 4;

/** @type {Workspace} */
export const taskBar = (place) => {
  const links = element("nav", { class: "links", "aria-label": tr("Tasks") }),
    jobs = element("ul", { class: "jobs", "aria-label": tr("Jobs") }),
    bar = element("section", { class: "card tasks", hidden: true }, links, jobs);
  place.append(bar);
  /** @type {string[]} */
  let offered = [];
  /** @type {Parameters<ReturnType<Workspace>>[0] | null} */
  let list = null;

  function draw() {
    if (!list) return;
    const query = [...list.chosen].map((name) => /** @type {[string, string]} */ (["run", name]));
    links.replaceChildren(
      ...offered.map((task) =>
        element(
          "a",
          { class: "button", href: `/task?${new URLSearchParams([["task", task], ...query])}` },
          TASKS[task].title,
        ),
      ),
    );
    bar.hidden = list.role !== "operator" || !offered.length;
  }

  async function look() {
    /** @type {{tasks: string[], jobs: Job[]}} */
    const answer = await json("/api/tasks", {});
    offered = answer.tasks.filter((task) => task in TASKS);
    jobs.replaceChildren(
      ...answer.jobs
        .filter((job) => job.task in TASKS)
        .slice(0, JOBS)
        .map((job) => {
          const states = {
            running: tr("running"),
            stopping: tr("stopping …"),
            done: tr("done"),
            failed: tr("failed"),
            stopped: tr("cancelled"),
          };
          const href = `/task?${new URLSearchParams({ task: job.task })}#job=${job.id}`;
          return element(
            "li",
            { class: job.state },
            element("a", { href }, TASKS[job.task].title),
            ` ${states[job.state]}`,
          );
        }),
    );
    draw();
  }

  const next = () =>
    (document.hidden ? Promise.resolve() : look().catch(() => {})).finally(() => setTimeout(next, EVERY_MS));
  next();
  return (now) => {
    list = now;
    draw();
  };
};
