// @ts-check
// The form of a task: runs, name of the result, and the fields that its command offers.
import { tr } from "./language.js";
import { element } from "./make.js";
import { GROUPS, label, unit } from "./task_words.js";
import { worded } from "./worded.js";

/** @import { RunRow } from "./runs_feed.js" */
/** @typedef {{name: string, help: string, default: string, kind: string, choices: string[]}} TaskField */
/** @typedef {Record<string, string>} Values */

/**
 * A labelled control.
 *
 * @param {string} name
 * @param {string} text
 * @param {HTMLInputElement | HTMLSelectElement} control
 * @param {string} [help]
 * @param {string} [unitText]
 */
export function row(name, text, control, help = "", unitText = "") {
  control.id = `field-${name}`;
  control.name = name;
  const small = element("small", { id: `help-${name}` }, help),
    wrong = element("small", { class: "wrong", id: `wrong-${name}`, role: "alert" });
  control.setAttribute("aria-describedby", `help-${name} wrong-${name}`);
  const title = element("label", { for: control.id }, text);
  if (unitText) title.append(element("span", { class: "unit" }, unitText));
  return element("div", { class: "field" }, title, control, small, wrong);
}

/** @param {TaskField} field */
function control(field) {
  if (field.kind === "flag") return element("input", { type: "checkbox" });
  if (field.kind === "choice") {
    const first = field.default ? tr("default: {value}", { value: field.default }) : "";
    return element(
      "select",
      {},
      element("option", { value: "" }, first),
      ...field.choices.map((value) => element("option", { value }, value)),
    );
  }
  return element("input", {
    type: "text",
    inputmode: field.kind === "number" ? "decimal" : null,
    placeholder: worded(field.default),
    autocomplete: "off",
    spellcheck: "false",
  });
}

/** @param {TaskField} field */
const fieldRow = (field) => row(field.name, label(field.name), control(field), worded(field.help), unit(field.name));

/**
 * All fields, those of a group folded.
 *
 * @param {HTMLElement} host
 * @param {TaskField[]} fields
 */
export function showFields(host, fields) {
  const grouped = GROUPS.map(([begin, title]) => ({
    begin,
    title,
    own: fields.filter((f) => f.name.startsWith(begin)),
  }));
  const alone = fields.filter((field) => !grouped.some(({ own }) => own.includes(field)));
  host.append(...alone.map(fieldRow));
  for (const { begin, title, own } of grouped) {
    if (!own.length) continue;
    const inside = element("div", { class: "fields" }, ...own.map(fieldRow));
    host.append(
      element(
        "details",
        { class: "group", "data-group": begin, open: begin === "limits." },
        element("summary", {}, title),
        inside,
      ),
    );
  }
}

/**
 * Rows of limits of a report, to which a person adds.
 *
 * @param {HTMLElement} host
 * @param {TaskField[]} fields
 * @returns {() => Values[]} the rows that are filled
 */
export function showLimits(host, fields) {
  const rows = element("div", { class: "limits" }),
    quantities = element(
      "datalist",
      { id: "quantities" },
      ...[...(fields[0]?.help.matchAll(/"([^"]+)"/g) ?? [])].map(([, value]) => element("option", { value })),
    );
  const add = () => {
    const number = rows.childElementCount + 1;
    const controls = fields.map((field) =>
      element("input", {
        type: "text",
        name: field.name,
        placeholder: label(field.name) + (unit(field.name) ? `, ${unit(field.name)}` : ""),
        "aria-label": `${label(field.name)} ${number}`,
        title: worded(field.help),
        list: field.name.endsWith("quantity") ? "quantities" : null,
        autocomplete: "off",
        spellcheck: "false",
      }),
    );
    const remove = element("button", { type: "button", "aria-label": tr("Remove limit {n}", { n: number }) }, "×");
    const line = element("div", { class: "limit" }, ...controls, remove);
    remove.addEventListener("click", () => line.remove());
    rows.append(line);
    controls[0].focus();
  };
  host.append(
    element(
      "fieldset",
      { class: "group" },
      element("legend", {}, tr("Limits that the machine must meet")),
      quantities,
      rows,
      element("button", { type: "button", id: "add-limit", onclick: add }, tr("Add a limit")),
      element("small", { class: "wrong", id: "wrong-report.limits", role: "alert" }),
    ),
  );
  return () =>
    [...rows.children]
      .map((line) => Object.fromEntries([...line.querySelectorAll("input")].map((i) => [i.name, i.value.trim()])))
      .map((values) => Object.fromEntries(Object.entries(values).filter(([, text]) => text)))
      .filter((values) => Object.keys(values).length);
}

/**
 * The texts of the filled fields.
 *
 * @param {TaskField[]} fields
 * @returns {Values}
 */
export function filled(fields) {
  /** @type {Values} */
  const values = {};
  for (const { name, kind } of fields) {
    const field = document.getElementById(`field-${name}`);
    if (kind === "flag") {
      if (field instanceof HTMLInputElement && field.checked) values[name] = "yes";
    } else if (field instanceof HTMLInputElement || field instanceof HTMLSelectElement) {
      if (field.value.trim()) values[name] = field.value.trim();
    }
  }
  return values;
}

/**
 * The field that a sentence of the command names first.
 *
 * @param {string} sentence
 * @param {string[]} names
 */
export function fieldOf(sentence, names) {
  const places = names.map((name) => {
    const key = name.startsWith("--") ? name : name.slice(name.lastIndexOf(".") + 1);
    const place = sentence.search(new RegExp(`(?<![\\w-])${key}(?![\\w-])`));
    return { name, place, whole: sentence.includes(name) };
  });
  const named = places.filter(({ place }) => place >= 0);
  return named.sort((a, b) => Number(b.whole) - Number(a.whole) || a.place - b.place)[0]?.name ?? null;
}

/**
 * Runs to choose from: one list of check boxes, or a choice for each.
 *
 * @param {HTMLElement} host
 * @param {string} task
 * @param {number} most
 * @param {RunRow[]} runs
 * @param {string[]} chosen
 * @param {() => void} onChange
 * @returns {() => string[]} the chosen ones
 */
export function showRuns(host, task, most, runs, chosen, onChange) {
  const whole = runs.filter((run) => run.state !== "broken");
  if (most > 2) {
    const boxes = whole.map((run) => {
      const box = element("input", { type: "checkbox", value: run.name, onchange: onChange, disabled: run.averaged });
      box.checked = chosen.includes(run.name) && !run.averaged;
      return box;
    });
    const lines = boxes.map((box) =>
      element("label", { class: "box" }, box, box.disabled ? tr("{run} (averaged)", { run: box.value }) : box.value),
    );
    const hint = boxes.some((box) => box.disabled)
      ? [element("small", {}, tr("No baseline is learned from averaged runs: measure again without the average."))]
      : [];
    const title = element("legend", {}, tr("Runs of the healthy machine"));
    host.append(element("fieldset", { class: "group boxes" }, title, ...lines, ...hint));
    return () => boxes.filter((box) => box.checked).map((box) => box.value);
  }
  const texts = { compare: [tr("Before"), tr("After")], design: [tr("Machine as measured by a run")] }[task] ?? [
    tr("Run"),
  ];
  const selects = texts.map((text, number) => {
    const empty = task === "design" ? tr("none: by its constants") : tr("choose a run");
    const select = element(
      "select",
      { onchange: onChange },
      element("option", { value: "" }, empty),
      ...whole.map((run) => element("option", { value: run.name }, run.name)),
    );
    select.value = whole.some((run) => run.name === chosen[number]) ? chosen[number] : "";
    host.append(row(`run-${number}`, text, select));
    return select;
  });
  return () => selects.map((select) => select.value).filter(Boolean);
}
