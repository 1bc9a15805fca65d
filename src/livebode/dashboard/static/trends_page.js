// @ts-check
// The trends of the runs that a search finds, one chart for each quantity.
import { chosen, remember } from "./address.js";
import { tr, trn } from "./language.js";
import { reason } from "./link.js";
import { byId as $, choose, element, segments } from "./make.js";
import { json, RunsFeed } from "./runs_feed.js";
import { found, ordered, words } from "./runs_search.js";
import { bounded, dateTime, quantity as named, pageOf, state, verdict } from "./runs_words.js";
import { applyTheme, nextTheme } from "./theme.js";
import { TrendChart } from "./trend_chart.js";
import { ALARMS, baselineMarks, quantitiesOf } from "./trends_data.js";

/** @import { RunTrend } from "./trends_data.js" */
/** @import { Range } from "./chart.js" */

const DAY_S = 86400,
  DETAILED = 6,
  TABLE_ROWS = 500;
/** @type {[value: string, text: string, days: number][]} */
const SPANS = [
  ["all", tr("all"), Infinity],
  ["year", tr("1 year"), 366],
  ["month", tr("30 days"), 30],
  ["week", tr("7 days"), 7],
];

applyTheme();
const search = $("search", HTMLInputElement),
  machine = $("machine", HTMLSelectElement),
  byWritten = $("by-written", HTMLInputElement);
/** @type {Map<string, RunTrend>} */
const trends = new Map();
/** @type {Map<string, TrendChart>} */
const charts = new Map();
/** @type {Map<string, Promise<void> | import("./trends_data.js").SentDetail[]>} */
const details = new Map();
/** @type {{version: number, waiting: number, span: string, zoom: Range | null}} */
const page = { version: 0, waiting: 1, span: chosen("span", "all"), zoom: zoomOf(chosen("zoom", "")) };
search.value = chosen("find", "");
const feed = new RunsFeed(
  () => look(),
  (error) => complain(error),
);

/** @param {unknown} error */
function complain(error) {
  $("notice").hidden = error === null;
  if (error !== null) $("notice").textContent = reason(error);
}

/**
 * @param {string} text
 * @returns {Range | null}
 */
function zoomOf(text) {
  const [from, to] = text.split("~").map(Number);
  return to > from ? [from, to] : null;
}

// Ask for trends until all runs are read.
async function look() {
  try {
    /** @type {{version: number, waiting: number, runs: Record<string, RunTrend>}} */
    const answer = await json("/api/trends", { since: page.version });
    Object.assign(page, { version: answer.version, waiting: answer.waiting });
    for (const [name, trend] of Object.entries(answer.runs)) {
      trends.set(name, trend);
      details.delete(name);
    }
    draw();
    if (answer.waiting) setTimeout(look, 50);
  } catch (error) {
    complain(error);
  }
}

function matching() {
  const wanted = words(search.value);
  const all = [...feed.runs.values()].filter((run) => found(run, wanted, [state(run), verdict(run)]));
  const machines = [...new Set(all.map((run) => run.machine))].filter(Boolean).sort();
  const known = chosen("machine", "");
  const wished = machines.includes(known) ? known : "";
  machine.replaceChildren(
    element("option", { value: "" }, tr("all")),
    ...machines.map((name) => element("option", { value: name }, name)),
  );
  machine.value = wished;
  $("machine-label").hidden = machines.length < 2;
  return wished ? all.filter((run) => run.machine === wished) : all;
}

function draw() {
  const runs = matching();
  const asked = chosen("written", "", ["yes", "no"]);
  byWritten.checked = asked ? asked === "yes" : runs.every(({ begun }) => begun === null); // else nothing was shown
  const { quantities, apart } = quantitiesOf(runs, trends, byWritten.checked);
  const marks = baselineMarks(runs, trends, byWritten.checked);
  const range = rangeOf(quantities);
  const inside = zoomedRuns(quantities, range);
  for (const name of inside) fetchDetails(name);
  const keys = new Set();
  for (const quantity of quantities) {
    const key = JSON.stringify([quantity.model, quantity.name, quantity.unit]);
    keys.add(key);
    const chart = charts.get(key) ?? new TrendChart($("cards"), { onZoom, onOpen });
    charts.set(key, chart);
    chart.take(quantity, marks, range, detailsOf(inside, quantity.model, quantity.name));
  }
  for (const [key, chart] of charts)
    if (!keys.has(key)) {
      chart.remove();
      charts.delete(key);
    }
  const count = trn("{n} run", "{n} runs", runs.length),
    rest = trn("{n} still to be read", "{n} still to be read", page.waiting);
  $("count").textContent = page.waiting ? `${count} · ${rest}` : count;
  $("none").hidden = Boolean(quantities.length) || Boolean(page.waiting);
  $("none").textContent = tr("There is nothing to show: no run with a time of day matches this search.");
  $("list", HTMLAnchorElement).href = search.value ? `/#${new URLSearchParams({ find: search.value })}` : "/";
  $("explanation").hidden = !quantities.length;
  $("baselines").textContent = marks
    .map(({ at, baseline }) =>
      tr("┆ {time}: compared with another baseline, {baseline}", { time: dateTime(at), baseline }),
    )
    .join("\n");
  $("cards").dataset.runs = page.waiting ? "" : String(runs.length); // all of them are drawn
  listApart(apart);
  table(quantities);
}

/**
 * @param {import("./trends_data.js").Quantity[]} quantities
 * @returns {Range}
 */
function rangeOf(quantities) {
  if (page.zoom) return page.zoom;
  const times = quantities.flatMap(({ points }) => [points[0]?.at, points.at(-1)?.at]).filter((at) => at !== undefined);
  const last = Math.max(...times),
    days = SPANS.find(([value]) => value === page.span)?.[2] ?? Infinity;
  const first = Math.max(Math.min(...times), last - days * DAY_S);
  const more = Math.max(0.03 * (last - first), 60);
  return times.length ? [first - more, last + more] : [0, 1];
}

/**
 * The runs in view, if they are few.
 *
 * @param {import("./trends_data.js").Quantity[]} quantities
 * @param {Range} range
 */
function zoomedRuns(quantities, [from, to]) {
  const names = new Set();
  for (const { points } of quantities)
    for (const { run, at, written } of points) if (at >= from && at <= to && !written) names.add(run);
  return names.size <= DETAILED ? [...names] : [];
}

/** @param {string} run */
function fetchDetails(run) {
  if (details.has(run)) return;
  const asked = json("/api/trend", { run }).then(
    ({ quantities }) => {
      if (details.get(run) !== asked) return;
      details.set(run, quantities);
      draw();
    },
    (error) => complain(error),
  );
  details.set(run, asked);
}

/**
 * @param {string[]} runs
 * @param {string} model
 * @param {string} name
 */
function detailsOf(runs, model, name) {
  return runs.flatMap((run) => {
    const known = details.get(run);
    if (!Array.isArray(known)) return [];
    const one = known.find((detail) => detail[0] === model && detail[1] === name);
    return one ? [{ at: one[2], value: one[4], bound: one[5] }] : [];
  });
}

/** @param {Range | null} range */
function onZoom(range) {
  page.zoom = range;
  remember("zoom", range ? range.map((at) => at.toFixed(3)).join("~") : "", "");
  choose($("span"), range ? "" : page.span);
  draw();
}

/**
 * @param {string} run
 * @param {number} timeS
 */
const onOpen = (run, timeS) => location.assign(pageOf(run, timeS));

/** @param {import("./runs_feed.js").RunRow[]} apart */
function listApart(apart) {
  $("apart").hidden = !apart.length && !byWritten.checked;
  const n = apart.length;
  $("apart-title").textContent = byWritten.checked
    ? tr("Runs without a time of day are shown with hollow points.")
    : trn(
        "{n} run has no time of day and is not in the charts",
        "{n} runs have no time of day and are not in the charts",
        n,
      );
  const links = ordered(apart, "name", false).map((run) => element("a", { href: pageOf(run.name) }, run.name));
  $("apart-runs").replaceChildren(...links.flatMap((link, i) => (i ? [tr(", "), link] : [link])));
}

/** @param {import("./trends_data.js").Quantity[]} quantities */
function table(quantities) {
  if (!$("table", HTMLDetailsElement).open) return;
  const heads = [tr("Run"), tr("Time"), tr("Quantity"), tr("Value")];
  $("table-head").replaceChildren(element("tr", {}, ...heads.map((text) => element("th", { scope: "col" }, text))));
  const rows = quantities.flatMap(({ name, unit, points }) =>
    points.map(({ run, at, timeS, value, bound }) => ({
      at,
      cells: [
        element("a", { href: pageOf(run, timeS) }, run),
        dateTime(at),
        name === ALARMS ? tr("Alarms") : named(name),
        name === ALARMS ? String(value) : bounded(value, bound, unit),
      ],
    })),
  );
  const newest = rows.sort((a, b) => b.at - a.at).slice(0, TABLE_ROWS);
  $("table-rows").replaceChildren(
    ...newest.map(({ cells }) => element("tr", {}, ...cells.map((one) => element("td", {}, one)))),
  );
}

segments(
  $("span"),
  SPANS.map(([value, text]) => ({ value, text })),
  page.zoom ? "" : page.span,
  /** @param {string} value */ (value) => {
    page.span = value;
    remember("span", value, "all");
    choose($("span"), value);
    onZoom(null);
  },
);
search.addEventListener("input", () => {
  remember("find", search.value, "");
  draw();
});
machine.addEventListener("change", () => {
  remember("machine", machine.value, "");
  draw();
});
byWritten.addEventListener("change", () => {
  remember("written", byWritten.checked ? "yes" : "no", "");
  draw();
});
$("table").addEventListener("toggle", draw);
$("theme").addEventListener("click", nextTheme);
document.addEventListener("keydown", (event) => {
  if (event.key !== "/" || event.target instanceof HTMLInputElement) return;
  event.preventDefault();
  search.focus();
});
feed.start();
