// @ts-check
// Buttons, tabs, downloads and keys.
import { moment } from "./clock.js";
import { Menu, numbers, picture } from "./download.js";
import { keys } from "./keys.js";
import { choose as chooseLanguage, language, tr } from "./language.js";
import { reason } from "./link.js";
import { byId as $, choose, element, segments } from "./make.js";
import { recognised } from "./recognition.js";
import { nextTheme } from "./theme.js";
import { fixed } from "./words.js";

/** @import { Page, Quantity } from "./messages.js" */

/** @type {[value: string, text: string][]} */
const TABS = [
  ["map", tr("Map")],
  ["parameters", tr("Parameters")],
  ["margins", tr("Margins")],
];
/** @type {[value: string, text: string][]} */
const SPANS = [
  ["20", "20 s"],
  ["120", "2 min"],
  ["whole", tr("all")],
];

/**
 * @param {Page} page
 * @param {object} parts
 * @param {import("./bode.js").Bode} parts.bode
 * @param {import("./tracking.js").Tracking} parts.tracking
 * @param {import("./map.js").LineMap} parts.map
 * @param {import("./timeline.js").Timeline} parts.timeline
 * @param {object} actions
 * @param {(quantity: Quantity, why?: string) => void} actions.watch
 * @param {() => void} actions.freeze
 * @param {() => void} actions.fill
 * @param {() => void} actions.watchShown
 * @param {() => void} actions.clear
 * @param {(text: string) => void} actions.complain
 */
export function controls(
  page,
  { bode, tracking, map, timeline },
  { watch, freeze, fill, watchShown, clear, complain },
) {
  /** @param {string} name */
  function tab(name) {
    page.tab = name;
    for (const [value] of TABS) $(`pane-${value}`).hidden = value !== name;
    for (const button of $("tabs").querySelectorAll("button")) {
      const on = button.dataset.value === name;
      button.setAttribute("aria-selected", String(on));
      button.tabIndex = on ? 0 : -1;
    }
    $("map-what").hidden = name !== "map";
    page.dirty.add("trends").add("rows");
    page.last.map = -1e9;
  }

  $("tabs").append(
    ...TABS.map(([value, text]) =>
      element(
        "button",
        {
          type: "button",
          role: "tab",
          id: `tab-${value}`,
          "aria-controls": `pane-${value}`,
          "data-value": value,
          onclick: () => tab(value),
        },
        text,
      ),
    ),
  );
  /**
   * @template {string} V
   * @param {string} id
   * @param {[value: V, text: string][]} choices
   * @param {V} chosen
   * @param {(value: V) => void} act
   */
  const option = (id, choices, chosen, act) =>
    segments(
      $(id),
      choices.map(([value, text]) => ({ value, text })),
      chosen,
      (value) => {
        choose($(id), value);
        act(value);
      },
    );
  option(
    "tracking-what",
    [
      ["magnitude", "dB"],
      ["phase", "°"],
    ],
    "magnitude",
    (value) => {
      tracking.what = value;
      tracking.build();
      page.dirty.add("rows");
    },
  );
  option(
    "tracking-over",
    [
      ["time", tr("time")],
      ["position", tr("position")],
    ],
    "time",
    (value) => {
      tracking.over = value;
      tracking.build();
      page.dirty.add("rows");
    },
  );
  option("tracking-span", SPANS, page.spanS, (value) => {
    page.spanS = value;
    page.rows.clear();
    fill();
  });
  option(
    "map-what",
    [
      ["level", tr("level")],
      ["change", tr("change")],
    ],
    "level",
    (value) => {
      map.what = value;
      map.paint();
    },
  );
  tab("map");

  const title = () => page.facts?.name ?? "";
  const stem = () => `${title()}-${page.quantity?.replace(" ", "-")}`;
  /**
   * @param {"csv" | "mat"} format
   * @param {boolean} whole
   */
  const query = (format, whole) => {
    const at = bode.curves.measured?.frame.timeS[0] ?? timeline.span.last_s;
    const [from, to] = whole ? [tracking.fromS, tracking.toS] : [at, at];
    return { axis: page.axis, quantity: page.quantity, format, from, to };
  };
  /** @param {() => void} act */
  const ready = (act) => () => (page.facts?.begun ? act() : complain(tr("The run has not started.")));
  /**
   * @param {"csv" | "mat"} format
   * @param {boolean} whole
   */
  const get = (format, whole) =>
    numbers(query(format, whole), `${stem()}${whole ? "-span" : ""}.${format}`).catch((error) =>
      complain(reason(error)),
    );
  const menu = new Menu($("download"), $("download-menu"), [
    [
      tr("Bode plot as PNG"),
      ready(() =>
        picture(
          `${stem()}.png`,
          `${title()}: ${recognised(page.quantity ?? "")}`,
          tr("at {time}, bands are ±3σ", { time: moment(bode.curves.measured?.frame.timeS[0], true) }),
          bode.charts,
        ),
      ),
    ],
    [tr("this response as CSV"), ready(() => get("csv", false))],
    [tr("this response as .mat"), ready(() => get("mat", false))],
    [tr("all responses in the time span as CSV"), ready(() => get("csv", true))],
    [tr("all responses in the time span as .mat"), ready(() => get("mat", true))],
  ]);
  const axis = $("axis", HTMLSelectElement);
  axis.addEventListener("change", () => {
    page.axis = page.wanted = Number(axis.value);
    page.quantity = null;
    if (page.frozen) freeze();
    timeline.atS = null;
    clear();
    watchShown();
  });
  $("freeze").addEventListener("click", freeze);
  $("theme").addEventListener("click", nextTheme);
  const languages = $("language", HTMLSelectElement);
  const names = Object.entries(language.languages);
  languages.append(...names.map(([value, name]) => element("option", { value, lang: value }, name)));
  languages.value = language.code;
  languages.addEventListener("change", () => chooseLanguage(languages.value));
  const help = $("keys", HTMLDialogElement);
  $("help").addEventListener("click", () => help.showModal());
  /** @param {number} i */
  const nth = (i) => () => {
    const q = page.facts?.begun && page.facts.quantities[i];
    if (q) watch(q.name, q.why_not);
  };
  keys(
    help,
    $("keys-list"),
    [
      [["?"], tr("this help"), () => help.showModal()],
      [[" "], tr("pause or resume"), () => timeline.toggle()],
      [["←", "→"], tr("move the cursor to the next line"), null],
      [[",", "."], tr("{seconds} s backward or forward in the record", { seconds: fixed(0.1, 1) }), null],
      [["1", "2", "3", "4"], tr("plant, open loop, closed loop, sensitivity"), null],
      [["F"], tr("freeze this curve as a reference, or release it"), freeze],
      [["M", "P", "G"], tr("map, parameters, margins"), null],
      [
        ["A"],
        tr("alarms only; go to the events"),
        () => {
          $("alarms-only").click();
          $("events").focus();
        },
      ],
      [["D"], tr("download"), () => menu.show(true)],
      [["0"], tr("full frequency band"), () => bode.zoom(bode.whole)],
      [["T"], tr("light or dark"), nextTheme],
    ],
    {
      "←": () => bode.step(-1),
      "→": () => bode.step(1),
      ",": () => timeline.step(-0.1),
      ".": () => timeline.step(0.1),
      1: nth(0),
      2: nth(1),
      3: nth(2),
      4: nth(3),
      M: () => tab("map"),
      P: () => tab("parameters"),
      G: () => tab("margins"),
    },
  );
}
