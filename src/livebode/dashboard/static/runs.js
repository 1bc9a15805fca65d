// @ts-check
// The start page: all runs of a directory.
import { chosen as fromAddress, remember } from "./address.js";
import { language, tr, trn } from "./language.js";
import { reason } from "./link.js";
import { byId as $, element } from "./make.js";
import { askDeletion, dialogs, editNotes } from "./runs_dialogs.js";
import { RunsFeed } from "./runs_feed.js";
import { found, ORDERS, ordered, since, words } from "./runs_search.js";
import { head, row } from "./runs_table.js";
import { state, verdict } from "./runs_words.js";
import { applyTheme, nextTheme } from "./theme.js";
import { WORKSPACES } from "./workspaces.js";

const SHOWN = 100;
applyTheme();
const search = $("search", HTMLInputElement),
  compare = $("compare", HTMLAnchorElement),
  trends = $("trends", HTMLAnchorElement);
const view = {
  by: fromAddress("order", "begun", ORDERS),
  down: fromAddress("down", "yes", ["yes", "no"]) === "yes",
  most: SHOWN,
};
/** @type {Set<string>} */
const chosen = new Set();
search.value = fromAddress("find", "");
const feed = new RunsFeed(draw, (error) => {
  $("notice").hidden = error === null;
  if (error !== null) $("notice").textContent = reason(error);
});

/** @type {import("./runs_table.js").Actions} */
const actions = {
  may: false,
  chosen,
  choose: (name, on) => {
    if (on) chosen.add(name);
    else chosen.delete(name);
    comparison();
    update();
  },
  search: (word) => {
    if (!words(search.value).includes(words(word)[0])) search.value = `${search.value} ${word}`.trim();
    searched();
  },
  edit: editNotes,
  remove: (run) => askDeletion(run, feed.directory),
};

const draws = Object.values(WORKSPACES).map((workspace) => workspace($("workspaces")));

function draw() {
  actions.may = feed.role === "operator";
  document.title = `${feed.directory} · livebode`;
  $("directory").textContent = feed.directory;
  for (const name of chosen) if (!feed.runs.has(name)) chosen.delete(name);
  const wanted = words(search.value);
  const all = [...feed.runs.values()];
  const matching = all.filter((run) => found(run, wanted, [state(run), verdict(run)]));
  const shown = ordered(matching, view.by, view.down).slice(0, view.most);
  const focused = document.activeElement?.getAttribute("data-key");
  $("head").replaceChildren(head(view.by, view.down, order));
  $("rows").replaceChildren(...shown.map((run) => row(run, actions)));
  if (focused)
    /** @type {HTMLElement | null} */ (document.querySelector(`[data-key="${CSS.escape(focused)}"]`))?.focus();
  const none = all.length ? tr("No run matches this search.") : tr("There is no run in this directory yet.");
  $("none").textContent = none;
  $("none").hidden = Boolean(matching.length);
  const runs = trn("{n} run", "{n} runs", all.length);
  $("count").textContent =
    matching.length === all.length ? runs : tr("{found} of {runs}", { found: matching.length, runs });
  $("more").hidden = matching.length <= shown.length;
  $("more").textContent = tr("Show all {count}", { count: matching.length });
  comparison();
  update();
}

function update() {
  for (const drawn of draws) drawn({ directory: feed.directory, role: feed.role, runs: feed.runs, chosen });
}

/** @param {string} by */
function order(by) {
  view.down = view.by === by ? !view.down : by !== "name" && by !== "machine";
  view.by = by;
  remember("order", by, "begun");
  remember("down", view.down ? "yes" : "no", "yes");
  draw();
}

function searched() {
  remember("find", search.value, "");
  trends.href = search.value ? `/trends#${new URLSearchParams({ find: search.value })}` : "/trends";
  view.most = SHOWN;
  draw();
}

// Two chosen runs can be compared, the earlier one as the one before.
function comparison() {
  const two = [...chosen].flatMap((name) => feed.runs.get(name) ?? []).sort((a, b) => since(a) - since(b));
  const ready = two.length === 2;
  if (ready) {
    const query = new URLSearchParams({ before: two[0].name, after: two[1].name, language: language.code });
    compare.href = `/compare?${query}`;
  } else compare.removeAttribute("href");
  compare.setAttribute("aria-disabled", String(!ready));
  const text = two.length ? two.map((run) => run.name).join(tr(", ")) : "";
  $("chosen").textContent = ready ? text : tr("Select two runs to compare them. {chosen}", { chosen: text }).trim();
}

search.addEventListener("input", searched);
$("more").addEventListener("click", () => {
  view.most = Infinity;
  draw();
});
$("theme").addEventListener("click", nextTheme);
document.addEventListener("keydown", (event) => {
  if (event.key !== "/" || event.target instanceof HTMLInputElement || event.target instanceof HTMLTextAreaElement)
    return;
  if (document.querySelector("dialog[open]")) return;
  event.preventDefault();
  search.focus();
});
dialogs(() => feed.look());
$("rows").replaceChildren(element("tr", {}, element("td", { colspan: 10 }, tr("reading …"))));
searched();
feed.start();
