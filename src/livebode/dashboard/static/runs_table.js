// @ts-check
// The table of the runs.
import { tr } from "./language.js";
import { element } from "./make.js";
import { tagWord } from "./runs_search.js";
import { began, bounded, duration, fit, lines, pageOf, quantity, size, state, verdict } from "./runs_words.js";
import { worded } from "./worded.js";

/** @import { RunRow } from "./runs_feed.js" */

/** @type {[key: string, text: string][]} */
const COLUMNS = [
  ["name", tr("Run")],
  ["begun", tr("Begun")],
  ["duration", tr("Duration")],
  ["machine", tr("Machine")],
  ["lines", tr("Lines")],
  ["verdict", tr("Verdict")],
  ["", tr("Newest fit")],
  ["size", tr("Size")],
];

/**
 * The head of the table; a click on a column orders by it.
 *
 * @param {string} by
 * @param {boolean} down
 * @param {(by: string) => void} onOrder
 */
export function head(by, down, onOrder) {
  const cells = COLUMNS.map(([key, text]) => {
    if (!key) return element("th", { scope: "col" }, text);
    const on = key === by;
    const button = element(
      "button",
      { type: "button", "data-key": `order-${key}`, onclick: () => onOrder(key) },
      text,
      element("span", { "aria-hidden": "true" }, on ? (down ? " ↓" : " ↑") : ""),
    );
    return element("th", { scope: "col", "aria-sort": on ? (down ? "descending" : "ascending") : null }, button);
  });
  const actions = element("th", { scope: "col" }, element("span", { class: "unseen" }, tr("Actions")));
  return element(
    "tr",
    {},
    element("th", { scope: "col" }, element("span", { class: "unseen" }, tr("Select"))),
    ...cells,
    actions,
  );
}

/**
 * @typedef {object} Actions
 * @property {boolean} may whether this person may change something
 * @property {Set<string>} chosen names of the chosen runs
 * @property {(name: string, on: boolean) => void} choose
 * @property {(word: string) => void} search
 * @property {(run: RunRow) => void} edit
 * @property {(run: RunRow) => void} remove
 */

/**
 * @param {RunRow} run
 * @param {Actions} actions
 */
export function row(run, actions) {
  const broken = run.state === "broken";
  const box = element("input", {
    type: "checkbox",
    "aria-label": tr("Select {run} to compare", { run: run.name }),
    "data-key": `choose-${run.name}`,
    disabled: broken,
    onchange: (event) => actions.choose(run.name, /** @type {HTMLInputElement} */ (event.target).checked),
  });
  box.checked = actions.chosen.has(run.name);
  const cells = [
    nameCell(run, actions),
    cell(1, began(run)),
    cell(2, duration(run.duration_s)),
    cell(3, run.machine || run.recording || "–", small(run.signals)),
    cell(4, lines(run), small(run.estimator)),
    cell(
      5,
      broken ? "–" : element("span", { class: `verdict ${run.tone}` }, verdict(run)),
      small(broken || run.tone === "open" ? "" : worded(run.said)),
    ),
    fitCell(run),
    cell(7, size(run.size_bytes)),
  ];
  return element(
    "tr",
    { "data-run": run.name, class: run.state },
    element("td", { class: "box" }, box),
    ...cells,
    buttonsCell(run, actions),
  );
}

/** A long name is broken between its words. @param {string} name */
const breakable = (name) => name.split(/(?<=[_.])/).flatMap((word, i) => (i ? [element("wbr"), word] : [word]));

/**
 * @param {number} column
 * @param {string | HTMLElement} text
 * @param {HTMLElement[]} more
 */
function cell(column, text, ...more) {
  const [key, label] = COLUMNS[column];
  return element(
    "td",
    { "data-label": label, "data-column": key, class: text === "–" ? "nothing" : null },
    text,
    ...more,
  );
}

/** @param {string} text */
const small = (text) => element("small", { class: "clamped" }, text);

/**
 * @param {RunRow} run
 * @param {Actions} actions
 */
function nameCell(run, actions) {
  const tags = run.tags.map((tag) =>
    element(
      "button",
      {
        type: "button",
        class: "tag",
        "data-key": `tag-${run.name}-${tag}`,
        title: tr("Show the runs with this tag"),
        onclick: () => actions.search(tagWord(tag)),
      },
      tag,
    ),
  );
  const broken = run.state === "broken";
  const name = broken
    ? element("span", { class: "name" }, ...breakable(run.name))
    : element("a", { href: pageOf(run.name), class: "name", "data-key": `open-${run.name}` }, ...breakable(run.name));
  const what = run.state === "finished" ? "" : state(run) + (broken ? `: ${worded(run.said)}` : "");
  const found = element("th", { scope: "row" }, name, ...tags);
  if (what) found.append(element("small", { class: `state ${run.state}` }, what));
  if (run.notes) found.append(element("small", { class: "notes clamped" }, run.notes));
  return found;
}

/** @param {RunRow} run */
function fitCell(run) {
  const found = element("td", { "data-label": COLUMNS[6][1], class: "fit" });
  for (const [name, value, bound, unit] of fit(run))
    found.append(element("small", {}, `${quantity(name)} ${bounded(value, bound, unit)}`));
  if (found.childNodes.length) return found;
  return cell(6, "–");
}

/**
 * @param {RunRow} run
 * @param {Actions} actions
 */
function buttonsCell(run, actions) {
  if (!actions.may) return element("td", {});
  const edit = element(
    "button",
    {
      type: "button",
      "data-key": `edit-${run.name}`,
      "aria-label": tr("Tags and notes: {run}", { run: run.name }),
      onclick: () => actions.edit(run),
    },
    tr("Notes"),
  );
  const remove = element(
    "button",
    {
      type: "button",
      "data-key": `delete-${run.name}`,
      "aria-label": tr("Delete {run}", { run: run.name }),
      disabled: run.state === "recording",
      title: run.state === "recording" ? tr("It is being recorded.") : null,
      onclick: () => actions.remove(run),
    },
    tr("Delete …"),
  );
  return element("td", { class: "actions" }, edit, remove);
}
