// @ts-check
// From a recording to a run: channels and their roles, lines and window as found, and the command that measures.
import { followJob } from "./job_progress.js";
import { tr, trn } from "./language.js";
import { post, reason } from "./link.js";
import { heardTable, listen } from "./live_source.js";
import { byId as $, element } from "./make.js";
import { Roles } from "./measure_roles.js";
import { Signals } from "./measure_signals.js";
import { json } from "./runs_feed.js";
import { applyTheme, nextTheme } from "./theme.js";
import { worded } from "./worded.js";
import { plain } from "./words.js";

/** @import { Channel, Guess, Role } from "./measure_roles.js" */
/** @import { Words } from "./messages.js" */

/**
 * @typedef {object} Facts What the server tells of a recording; see recordings.py.
 * @property {string} recording
 * @property {string} format
 * @property {number} rate_hz
 * @property {boolean} rate_given
 * @property {number} begin_s
 * @property {number} end_s
 * @property {number} gaps
 * @property {Channel[]} channels
 * @property {[name: string, reason: string][]} skipped
 * @property {Record<Role, Guess>} roles
 * @property {string[]} estimators
 * @property {string[]} models
 * @property {import("./live_source.js").Heard[]} [heard] of a live source
 * @property {boolean} [rate_measured] by the arrival of what another program sends
 */
/**
 * @typedef {object} Configuration
 * @property {string} text
 * @property {{frequencies: string, window: number} | null} lines
 * @property {Words} lines_found
 * @property {Words} window_found
 * @property {string} estimator
 * @property {Words} estimator_reason
 * @property {boolean} average
 * @property {string} model
 * @property {Words[]} doubts
 * @property {string} command
 */

/** @typedef {{job: string, run: string}} Started */

const SETTLE_MS = 250,
  LOOK_MS = 500;
const query = new URLSearchParams(location.search),
  recording = query.get("recording") ?? "",
  rateGiven = Number(query.get("rate_hz")) || null;
const frequencies = $("frequencies", HTMLInputElement),
  window_ = $("window", HTMLInputElement),
  estimator = $("estimator", HTMLSelectElement),
  average = $("average", HTMLInputElement),
  model = $("model", HTMLSelectElement),
  baseline = $("baseline", HTMLSelectElement),
  from = $("from", HTMLInputElement),
  to = $("to", HTMLInputElement),
  measure = $("measure", HTMLButtonElement);
/** Fields that a person has changed: what is found does not replace them. @type {Set<HTMLElement>} */
const edited = new Set();
let waiting = 0,
  asked = 0;

/** @param {unknown} error */
function complain(error) {
  $("notice").hidden = error === null;
  $("notice").textContent = error === null ? "" : reason(error);
}

/** @param {number | null} rateHz */
async function open(rateHz) {
  $("facts").textContent = tr("reading …");
  try {
    show(await json("/api/recording", { recording, ...(rateHz === null ? {} : { rate_hz: String(rateHz) }) }));
    complain(null);
  } catch (error) {
    $("facts").textContent = "";
    complain(error);
    $("rate").hidden = !(error instanceof Error && /rate/i.test(error.message));
    $("again").hidden = !recording.includes("://");
  }
}

/** @param {Facts} facts */
function show(facts) {
  const lasting = facts.end_s - facts.begin_s,
    words = [
      tr("{seconds} s at {rate} Hz", { seconds: plain(lasting, 4), rate: plain(facts.rate_hz, 6) }),
      trn("{n} channel", "{n} channels", facts.channels.length),
      ...(facts.gaps ? [trn("{n} gap", "{n} gaps", facts.gaps)] : []),
    ];
  $("facts").textContent = words.join(" · ");
  $("steps").hidden = $("next").hidden = false;
  if (facts.heard) showHeard(facts, facts.heard);
  const signals = new Signals($("signals"), $("more", HTMLButtonElement), facts, complain);
  const roles = new Roles($("slots"), facts.channels, facts.roles, () => {
    signals.mark(roles.chosen);
    settle();
  });
  for (const name of facts.estimators) estimator.append(element("option", { value: name }, name));
  for (const name of facts.models)
    model.append(element("option", { value: name }, name === "none" ? tr("none") : name));
  from.placeholder = plain(facts.begin_s, 6);
  to.placeholder = plain(facts.end_s, 6);

  const choices = () => ({
    recording,
    ...(facts.rate_given ? { rate_hz: facts.rate_hz } : {}),
    signals: roles.chosen,
    begin_s: limit(from),
    end_s: limit(to),
    lines: lines(),
    estimator: edited.has(estimator) ? estimator.value : null,
    average: edited.has(average) ? average.checked : null,
    model: edited.has(model) ? model.value : null,
    baseline: baseline.value || null,
  });

  function settle() {
    measure.disabled = true;
    clearTimeout(waiting);
    waiting = setTimeout(propose, SETTLE_MS);
  }

  async function propose() {
    const number = ++asked;
    $("ready").textContent = tr("finding lines and window …");
    try {
      /** @type {Configuration} */
      const found = await post("/api/configuration", choices());
      if (number === asked) fill(found);
    } catch (error) {
      if (number !== asked) return;
      $("ready").textContent = reason(error);
      $("ready").className = "wrong";
      $("toml").hidden = true;
      $("lines-found").textContent = $("window-found").textContent = "";
    }
  }

  /** @param {() => Promise<Started>} start */
  async function run(start) {
    measure.disabled = true;
    $("ready").textContent = tr("Measuring …");
    $("ready").className = "";
    try {
      const { job, run } = await start();
      // The address has the job, so that it is followed again after a reload.
      history.replaceState(null, "", `#${new URLSearchParams({ job, run })}`);
      $("ready").hidden = measure.hidden = true;
      // A live measurement lasts until somebody finishes it, on the page of its run.
      const ends = [followJob($("job"), job, tr("Measuring …")), ...(facts.heard ? [recorded(run)] : [])];
      const ended = await Promise.race(ends);
      forgetJob();
      if (ended === null || ended.state === "done") {
        location.assign(`/run/${encodeURIComponent(run)}/`);
        return;
      }
      throw new Error(ended.state === "stopped" ? tr("The measurement was cancelled.") : ended.sentence);
    } catch (error) {
      forgetJob();
      $("job").replaceChildren();
      $("ready").hidden = measure.hidden = measure.disabled = false;
      $("ready").textContent = reason(error);
      $("ready").className = "wrong";
    }
  }

  for (const field of [frequencies, window_, estimator, average, model, baseline, from, to])
    field.addEventListener("input", () => {
      edited.add(field);
      if (field === from || field === to) used();
      settle();
    });

  function used() {
    const span = /** @type {[number, number]} */ ([limit(from) ?? facts.begin_s, limit(to) ?? facts.end_s]);
    signals.use(span);
    $("whole").hidden = from.value === "" && to.value === "";
  }

  signals.onZoom = () => {
    $("use").hidden = signals.whole || facts.heard !== undefined;
  };
  $("use").addEventListener("click", () => {
    // A thousandth of what is shown is less than a pixel.
    const digits = Math.max(0, 3 - Math.floor(Math.log10(signals.span[1] - signals.span[0])));
    [from.value, to.value] = signals.span.map((s) =>
      String(Math.min(Math.max(Number(s.toFixed(digits)), facts.begin_s), facts.end_s)),
    );
    used();
    settle();
  });
  $("whole").addEventListener("click", () => {
    from.value = to.value = "";
    signals.zoom([facts.begin_s, facts.end_s]);
    used();
    settle();
  });
  measure.addEventListener("click", () => run(() => post("/api/measure", choices())));
  json("/api/task", { task: "learn" })
    .then(({ results }) => {
      for (const { name } of results) baseline.append(element("option", { value: name }, name));
    })
    .catch(complain);
  signals.mark(roles.chosen);
  signals.fetch();
  const { job, run: name } = Object.fromEntries(new URLSearchParams(location.hash.slice(1)));
  propose();
  if (job && name) run(async () => ({ job, run: name }));
}

const forgetJob = () => history.replaceState(null, "", location.pathname + location.search);

/**
 * What came from a live source, whose rate can be corrected; a measurement of it has no span.
 *
 * @param {Facts} facts
 * @param {import("./live_source.js").Heard[]} heard
 */
function showHeard(facts, heard) {
  $("heard").hidden = $("again").hidden = false;
  $("rate").hidden = !facts.rate_measured;
  $("channels").replaceChildren(heardTable(heard));
  $("rate-hz", HTMLInputElement).value = String(facts.rate_hz);
  $("rate-set").textContent = tr("Set");
  $("span").hidden = true;
}

/**
 * Until a live source is recorded: its run is in the list.
 *
 * @param {string} run
 */
async function recorded(run) {
  for (;;) {
    /** @type {import("./runs_feed.js").Answer} */
    const { runs } = await json("/api/runs", { since: 0 });
    if (runs.some(({ name }) => name === run)) return null;
    await new Promise((done) => setTimeout(done, LOOK_MS));
  }
}

/** @param {HTMLInputElement} field */
const limit = (field) => (field.value === "" ? null : Number(field.value));

/** Lines and window that a person has changed; they need each other. */
function lines() {
  if (!(edited.has(frequencies) || edited.has(window_)) || !frequencies.value || !window_.value) return null;
  return { frequencies: frequencies.value, window: Number(window_.value) };
}

/** @param {Configuration} found */
function fill(found) {
  if (!edited.has(frequencies) && !edited.has(window_)) {
    frequencies.value = found.lines?.frequencies ?? "";
    window_.value = found.lines ? String(found.lines.window) : "";
  }
  $("lines-found").textContent = worded(found.lines_found);
  $("window-found").textContent = worded(found.window_found);
  estimator.value = found.estimator;
  $("estimator-found").textContent = worded(found.estimator_reason);
  average.checked = found.average;
  model.value = found.model;
  $("text").textContent = found.text;
  $("command").textContent = found.command;
  $("toml").hidden = false;
  const doubts = found.doubts.map((doubt) => worded(doubt));
  $("ready").textContent = doubts.length
    ? doubts.join(" ")
    : [worded(found.lines_found), tr("ready to measure")].filter(Boolean).join(" · ");
  $("ready").className = doubts.length ? "doubt" : "";
  measure.disabled = false;
}

applyTheme();
document.title = `${recording} · livebode`;
$("recording").textContent = recording;
$("theme").addEventListener("click", nextTheme);
$("copy").addEventListener("click", async () => {
  await navigator.clipboard.writeText($("text").textContent ?? "");
  $("copy").textContent = tr("Copied");
});
$("rate").addEventListener("submit", (event) => {
  event.preventDefault();
  location.search = new URLSearchParams({ recording, rate_hz: $("rate-hz", HTMLInputElement).value }).toString();
});
$("again").addEventListener("click", async () => {
  const button = $("again", HTMLButtonElement);
  button.disabled = true;
  $("facts").textContent = tr("listening for 3 s …");
  try {
    const { usable, trouble } = await listen(recording);
    if (!usable) throw new Error(worded(trouble));
    location.reload();
  } catch (error) {
    complain(error);
    $("facts").textContent = "";
    button.disabled = false;
  }
});
open(rateGiven);
