// @ts-check
// The page of a task beside measuring: its form, its job, and its results.
import { followJob } from "./job_progress.js";
import { language, tr } from "./language.js";
import { reason, refusal } from "./link.js";
import { byId as $, element } from "./make.js";
import { json } from "./runs_feed.js";
import { since } from "./runs_search.js";
import { size } from "./runs_words.js";
import { fieldOf, filled, row, showFields, showLimits, showRuns } from "./task_form.js";
import { TASKS } from "./task_words.js";
import { applyTheme, nextTheme } from "./theme.js";
import { worded } from "./worded.js";

/** @import { Job } from "./job_progress.js" */
/** @import { TaskField } from "./task_form.js" */
/** @typedef {{name: string, files: [string, number][], written: number, choices?: string[][]}} Result */
/** @typedef {{fields: TaskField[], limits: TaskField[], results: Result[], role: string, runs: [number, number]}} Answer */

const query = new URLSearchParams(location.search),
  task = query.get("task") ?? "",
  words = TASKS[task];
const NAMES = { compare: "comparison", learn: "healthy", design: "excitation" };
/** Files for other programs first, then what livebode reads. */
const ORDER = [".html", ".pdf", ".csv", ".wav", ".h", ".st", ".mat", ".npz", ".toml", ".json"];
applyTheme();
$("theme").addEventListener("click", nextTheme);

/** @param {unknown} error */
function complain(error) {
  $("notice").hidden = error === null;
  $("notice").textContent = error === null ? "" : reason(error);
}

/** @param {string} file */
const rank = (file) => {
  const place = ORDER.findIndex((ending) => file.endsWith(ending));
  return place < 0 ? ORDER.length : place;
};

/**
 * The files of a result, a picture and the reasons of a design.
 *
 * @param {Result} result
 * @param {boolean} whole
 */
function resultShown(result, whole) {
  /** @param {string} file */
  const place = (file) => `/result/${[task, result.name, file].map(encodeURIComponent).join("/")}`;
  const parts = element("div", { class: "result" }, element("b", {}, result.name));
  const links = [...result.files]
    .filter(([file]) => !file.endsWith(".schema.json"))
    .sort(([a], [b]) => rank(a) - rank(b))
    .map(([file, bytes]) => {
      const shown = file.endsWith(".html") || file.endsWith(".svg");
      const link = element(
        "a",
        {
          class: "button",
          href: place(file),
          target: shown ? "_blank" : null,
          rel: "noopener",
          download: shown ? null : file,
        },
        shown ? tr("Open {file}", { file }) : file,
        element("small", {}, size(bytes)),
      );
      return link;
    });
  parts.append(element("div", { class: "links" }, ...links));
  if (task === "learn")
    parts.append(
      element(
        "p",
        {},
        tr("A new run is compared with it: choose it where you measure, or run {command}", {
          command: `livebode run … --baseline=baselines/${result.name}.json`,
        }),
      ),
    );
  if (!whole) return parts;
  const picture = result.files.find(([file]) => file.endsWith(".svg"));
  if (picture)
    parts.append(
      element("img", {
        src: place(picture[0]),
        alt: tr("One period of the excitation, its lines, and what the machine does"),
      }),
    );
  if (result.choices?.length) {
    const rows = result.choices.map((cells) =>
      element(
        "tr",
        {},
        element("th", { scope: "row" }, cells[0]),
        element("td", {}, cells[1]),
        element("td", {}, cells[2]),
      ),
    );
    const head = element(
      "tr",
      {},
      ...[tr("Chosen"), tr("Value"), tr("Why")].map((text) => element("th", { scope: "col" }, text)),
    );
    parts.append(element("table", {}, element("thead", {}, head), element("tbody", {}, ...rows)));
  }
  return parts;
}

/** @param {Job} job */
const nameOf = (job) => {
  const out = job.arguments.find((word) => word.startsWith("--out="));
  return out ? (out.split("/").pop() ?? "").replace(/\.json$/, "") : (job.arguments.at(-1) ?? "");
};

/** @param {string} word as a shell takes it */
function quoted(word) {
  if (/^[\w./=:@%+,-]+$/.test(word)) return word;
  const inside = word.split("'").join("'\\''");
  return `'${inside}'`;
}

/** @param {boolean} working */
const busy = (working) => $("answer").setAttribute("aria-busy", String(working));

/** @param {string[]} names of the fields */
function followed(names) {
  /** @param {string} id */
  return async (id) => {
    busy(true);
    $("answer").hidden = false;
    $("files").replaceChildren();
    $("sentence").textContent = "";
    $("printed").hidden = true;
    const job = await followJob($("job"), id, words.doing);
    $("job").replaceChildren();
    const command = ["livebode", ...job.arguments].map(quoted).join(" ");
    $("command").textContent = command;
    $("output").textContent = job.output;
    $("printed").hidden = false;
    const done = job.state === "done";
    $("sentence").textContent = done
      ? job.sentence
      : job.state === "stopped"
        ? tr("Cancelled. {sentence}", { sentence: job.sentence })
        : "";
    $("printed", HTMLDetailsElement).open = done && task !== "design";
    if (!done && job.state !== "stopped") {
      const field = fieldOf(job.sentence, names);
      const place = field ? document.getElementById(`wrong-${field}`) : null;
      (place ?? $("wrong")).textContent = job.sentence;
      place?.closest("details")?.setAttribute("open", "");
      place?.scrollIntoView({ block: "center" });
      if (!place) $("wrong").scrollIntoView({ block: "center" });
    }
    await showResults(done ? nameOf(job) : null);
    busy(false);
  };
}

/** @param {string | null} newest */
async function showResults(newest) {
  /** @type {Answer} */
  const { results } = await json("/api/task", { task });
  const own = results.find(({ name }) => name === newest);
  if (own) $("files").replaceChildren(resultShown(own, true));
  const others = results.filter((result) => result !== own);
  $("earlier").hidden = !others.length;
  $("results").replaceChildren(...others.map((result) => element("li", {}, resultShown(result, false))));
}

/** @param {object} request */
async function started(request) {
  const answer = await fetch("/api/task", {
    method: "POST",
    headers: { "content-type": "application/json" },
    body: JSON.stringify(request),
  });
  if (!answer.ok) throw await refusal(answer);
  return /** @type {string} */ ((await answer.json()).job);
}

async function show() {
  /** @type {Answer} */
  const { fields, limits, results, role, runs: needed } = await json("/api/task", { task });
  const { runs } = await json("/api/runs", { since: 0 });
  const wanted = query.getAll("run");
  const known = new Map(runs.map((/** @type {import("./runs_feed.js").RunRow} */ run) => [run.name, run]));
  const chosen = wanted.filter((name) => known.has(name)).sort((a, b) => since(known.get(a)) - since(known.get(b)));
  const form = $("ask", HTMLFormElement);
  const picked = showRuns($("runs"), task, needed[1], [...known.values()], chosen, ready);
  if (task in NAMES) {
    const name = element("input", {
      type: "text",
      autocomplete: "off",
      spellcheck: "false",
      maxlength: 64,
      required: true,
    });
    name.value = free(NAMES[/** @type {"learn"} */ (task)], results);
    $("runs").append(row("--out", tr("Name of the result"), name));
  }
  showFields($("fields"), fields);
  const rows = limits.length ? showLimits($("fields"), limits) : () => [];
  const names = [...fields.map(({ name }) => name), ...(limits.length ? ["report.limits"] : []), "--out"];
  const follow = followed(names);
  $("start").textContent = words.start;

  function ready() {
    const count = picked().length;
    $("start", HTMLButtonElement).disabled = role !== "operator" || count < needed[0];
    if (task === "design")
      for (const group of form.querySelectorAll("details[data-group]"))
        group.toggleAttribute(
          "hidden",
          (count ? ["belt."] : ["measured.", "loop."]).includes(group.getAttribute("data-group") ?? ""),
        );
  }
  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    complain(null);
    for (const place of form.querySelectorAll(".wrong")) place.textContent = "";
    const button = $("start", HTMLButtonElement);
    button.disabled = true;
    busy(true);
    try {
      const values = filled(fields);
      if (task === "report" || task === "compare") values["--language"] = language.code;
      const name = document.getElementById("field---out");
      const id = await started({
        task,
        runs: picked(),
        name: name instanceof HTMLInputElement ? name.value : "",
        values,
        limits: rows(),
      });
      history.replaceState(null, "", `#job=${id}`);
      await follow(id);
    } catch (error) {
      complain(error);
    } finally {
      busy(false);
      ready();
    }
  });
  form.hidden = false;
  if (role !== "operator") complain(new Error(tr("this session is read-only")));
  ready();
  await showResults(null);
  const id = new URLSearchParams(location.hash.slice(1)).get("job");
  if (id) await follow(id);
}

/**
 * A name that no result has.
 *
 * @param {string} name
 * @param {Result[]} results
 */
function free(name, results) {
  const taken = new Set(results.map((result) => result.name));
  let number = 1;
  while (taken.has(number > 1 ? `${name}-${number}` : name)) number++;
  return number > 1 ? `${name}-${number}` : name;
}

$("copy").addEventListener("click", () => navigator.clipboard?.writeText($("command").textContent ?? ""));
if (words) {
  $("title").textContent = words.title;
  document.title = `${words.title} · livebode`;
  $("about").textContent = words.about;
  show().catch(complain);
} else complain(new Error(worded(tr("There is no such task."))));
