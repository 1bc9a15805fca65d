// @ts-check
// The page of a fleet: a tile for each axis, the hierarchy, lists and the floor plan.
import { chosen, enter, remember } from "./address.js";
import { Acts } from "./fleet_acts.js";
import { AxisDialog } from "./fleet_axis.js";
import { FleetFeed } from "./fleet_feed.js";
import { SIZES } from "./fleet_groups.js";
import { Lists } from "./fleet_lists.js";
import { Place } from "./fleet_place.js";
import { FloorPlan } from "./fleet_plan.js";
import { Tiles } from "./fleet_tiles.js";
import { LOOKS, thousands, URGENT } from "./fleet_words.js";
import { tr, trn } from "./language.js";
import { byId as $, choose, element, segments } from "./make.js";
import { words } from "./runs_search.js";
import { applyTheme, nextTheme } from "./theme.js";
import { worded } from "./worded.js";

const COUNT_MS = 500;
applyTheme();
const search = $("search", HTMLInputElement);
search.value = chosen("find", "");
/** @type {Set<string>} keys of the looks that are shown; all if it is empty */
const only = new Set(chosen("states", "").split(",").filter(Boolean));
/** @type {string} */
let place = chosen("place", "");
/** @type {string} */
let view = chosen("view", "tiles");
/** @type {number | undefined} */
let timer;
let counted = -COUNT_MS,
  alarms = 0,
  complaint = "";

const feed = new FleetFeed({
  onAxes: begin,
  onLooks: looked,
  onNews: (news) => {
    if (news.error) complain(worded(news.words ?? news.error));
    if (news.trouble !== undefined) trouble(news.trouble);
    lists.take(news);
    axis.take(news.axis);
    heard(news.open ?? alarms);
  },
  onState: (up) => {
    document.body.classList.toggle("stale", !up);
    complain(up ? "" : tr("No connection to the server: the page shows the last known state."));
  },
});
const acts = new Acts(feed, complain);
const axis = new AxisDialog(feed, acts, (path) => remember("axis", path, ""));
const open = (/** @type {number} */ one) => axis.open(one);
const tiles = new Tiles($("tiles"), open);
const lists = new Lists({ host: $("events"), views: $("lists"), summary: $("summary") }, feed, acts, open);
const places = new Place($("crumbs"), $("nodes"), go);
const plan = new FloorPlan($("plan"), (path, one) => {
  if (one !== null) open(one);
  else {
    go(path);
    shows("tiles");
  }
});

/** @param {string} text */
function complain(text) {
  complaint = text;
  $("notice").hidden = !text;
  $("notice").textContent = text;
}

/** @param {string} text */
function trouble(text) {
  if (text || complaint) complain(text && tr("The log of the fleet does not answer: {reason}", { reason: text }));
}

function begin() {
  const { fleet, paths } = feed;
  $("name").textContent = fleet?.name ?? "";
  document.title = `${fleet?.name} · livebode`;
  if (place && !paths.some((path) => path.startsWith(`${place}/`))) place = "";
  tiles.paths = paths;
  $("views").hidden = !fleet?.plan;
  places.go(place, paths, fleet?.name ?? "");
  shows(fleet?.plan && view === "plan" ? "plan" : "tiles");
  const known = paths.indexOf(chosen("axis", ""));
  if (known >= 0) open(known);
}

function looked() {
  tiles.looks = feed.looks;
  if (only.size) arrange();
  else tiles.soon();
  if (!$("plan").hidden) plan.colour(feed.looks);
  countSoon();
}

function countSoon() {
  if (timer !== undefined) return;
  timer = setTimeout(
    () => {
      timer = undefined;
      count();
    },
    Math.max(0, counted + COUNT_MS - performance.now()),
  );
}

function count() {
  counted = performance.now();
  places.count(feed.looks);
  const all = new Uint32Array(LOOKS.length);
  for (const look of feed.looks) all[look]++;
  chips(all);
}

// Which axes are shown: those of the place that have all words of the search and one of the chosen states.
function arrange() {
  const { paths, looks } = feed,
    inside = place ? `${place}/` : "",
    wanted = words(search.value);
  const begin = inside
    ? Math.max(
        0,
        paths.findIndex((path) => path.startsWith(inside)),
      )
    : 0;
  const found = [];
  for (let at = begin; at < paths.length && paths[at].startsWith(inside); at++) {
    if (only.size && !only.has(LOOKS[looks[at]].key)) continue;
    if (wanted.length) {
      const path = paths[at].normalize("NFKC").toLowerCase();
      if (!wanted.every((word) => path.includes(word))) continue;
    }
    found.push(at);
  }
  tiles.looks = looks;
  tiles.show(found, place ? place.split("/").length + 1 : 1);
  $("none").hidden = found.length > 0 || !feed.fleet;
  $("none").textContent = paths.length ? tr("No axis matches.") : tr("No worker has reported an axis yet.");
  const all = trn("{n} axis", "{n} axes", paths.length).replace(String(paths.length), thousands(paths.length));
  $("count").textContent =
    found.length === paths.length ? all : tr("{found} of {axes}", { found: thousands(found.length), axes: all });
}

/** @param {Uint32Array} all */
function chips(all) {
  const buttons = URGENT.filter((look) => all[look] || only.has(LOOKS[look].key)).map((look) => {
    const { key, sign, words: text } = LOOKS[look];
    return element(
      "button",
      {
        type: "button",
        class: `look-${key}`,
        "aria-pressed": String(only.has(key)),
        "data-look": key,
        onclick: () => filter(key),
      },
      element("span", { class: "sign", "aria-hidden": "true" }, sign),
      ` ${text} `,
      element("b", {}, thousands(all[look])),
    );
  });
  const host = $("looks"),
    focused = document.activeElement instanceof HTMLElement ? document.activeElement.dataset.look : undefined;
  if (
    host.textContent === buttons.map(({ textContent }) => textContent).join("") &&
    host.dataset.only === [...only].join()
  )
    return;
  host.dataset.only = [...only].join();
  host.replaceChildren(...buttons);
  if (focused) /** @type {HTMLElement | null} */ (host.querySelector(`[data-look="${focused}"]`))?.focus();
}

/** @param {string} key */
function filter(key) {
  if (!only.delete(key)) only.add(key);
  remember("states", [...only].join(","), "");
  arrange();
  count();
}

/** @param {string} path */
function go(path) {
  const exact = feed.paths.indexOf(path);
  if (exact >= 0 && !feed.paths[exact + 1]?.startsWith(`${path}/`)) {
    open(exact);
    return;
  }
  place = path;
  enter();
  remember("place", path, "");
  places.go(path, feed.paths, feed.fleet?.name ?? "");
  $("tiles").scrollTop = 0;
  arrange();
  count();
}

/** @param {string} which */
function shows(which) {
  view = which;
  const planned = view === "plan";
  remember("view", view, "tiles");
  choose($("views"), view);
  $("tiles").hidden = planned;
  $("sizes").hidden = planned;
  $("plan").hidden = !planned;
  arrange();
  count();
  if (planned) plan.show(feed.paths, feed.looks);
}

// A new alarm is read out; what goes away is seen.
/** @param {number} now */
function heard(now) {
  if (now > alarms) $("heard").textContent = trn("{n} alarm not acknowledged", "{n} alarms not acknowledged", now);
  alarms = now;
}

/** @param {string} name */
function size(name) {
  remember("size", name, "small");
  choose($("sizes"), name);
  tiles.resized(name);
}

segments(
  $("views"),
  [
    { value: "tiles", text: tr("Tiles") },
    { value: "plan", text: tr("Floor plan") },
  ],
  "tiles",
  shows,
);
const first = chosen("size", "small", Object.keys(SIZES));
segments(
  $("sizes"),
  [
    { value: "small", text: tr("small") },
    { value: "medium", text: tr("medium") },
    { value: "large", text: tr("large") },
  ],
  first,
  size,
);
size(first);
search.addEventListener("input", () => {
  remember("find", search.value, "");
  arrange();
});
$("theme").addEventListener("click", nextTheme);
document.addEventListener("keydown", (event) => {
  if (event.key !== "/" || event.target instanceof HTMLInputElement || document.querySelector("dialog[open]")) return;
  event.preventDefault();
  search.focus();
});
feed.start();
Object.assign(window, { livebode: { feed, tiles, lists, places, plan, axis } });
