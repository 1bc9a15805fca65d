// @ts-check
// Buttons, tabs, downloads and keys.
import { chosen, remember } from "./address.js";
import { stamp } from "./clock.js";
import { Menu, numbers } from "./download.js";
import { enlarging } from "./enlarge.js";
import { exportDialog } from "./export.js";
import { keys } from "./keys.js";
import { kinds } from "./kinds.js";
import { choose as chooseLanguage, language, tr } from "./language.js";
import { reason } from "./link.js";
import { byId as $, element } from "./make.js";
import { Option } from "./options.js";
import { heightKeys, mapKeys, planeKeys } from "./plot-keys.js";
import { plots } from "./plots.js";
import { printed } from "./printed.js";
import { copyLink } from "./shared.js";
import { table } from "./table.js";
import { nextTheme } from "./theme.js";
import { worded } from "./worded.js";
import { fixed } from "./words.js";
import { nextClock } from "./zone.js";

/** @import { Page, Quantity } from "./messages.js" */

/** @type {[value: string, text: string][]} */
const TABS = [
  ["map", tr("Map")],
  ["parameters", tr("Parameters")],
  ["margins", tr("Margins")],
  ["signals", tr("Signals")],
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
 * @param {import("./signals.js").Signals} parts.signals
 * @param {import("./timeline.js").Timeline} parts.timeline
 * @param {import("./events.js").Events} parts.events
 * @param {import("./wall.js").Wall} parts.wall
 * @param {import("./references.js").References} parts.references
 * @param {object} actions
 * @param {(quantity: Quantity, why?: string) => void} actions.watch
 * @param {() => void} actions.fill
 * @param {() => void} actions.watchShown
 * @param {() => void} actions.clear
 * @param {(text: string) => void} actions.complain
 * @param {(axis: number) => void} actions.axisChosen
 */
export function controls(
  page,
  { bode, tracking, map, signals, timeline, events, wall, references },
  { watch, fill, watchShown, clear, complain, axisChosen },
) {
  /** @param {string} name */
  function tab(name) {
    page.tab = name;
    remember("tab", name, "map");
    for (const [value] of TABS) $(`pane-${value}`).hidden = value !== name;
    for (const button of $("tabs").querySelectorAll("button")) {
      const on = button.dataset.value === name;
      button.setAttribute("aria-selected", String(on));
      button.tabIndex = on ? 0 : -1;
    }
    for (const choice of ["map-what", "map-over"]) $(choice).hidden = name !== "map";
    $("signals-picture").hidden = name !== "signals";
    page.dirty.delete("map");
    page.dirty.add("fits").add("trends").add("rows");
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
  new Option(
    $("tracking-what"),
    "track",
    /** @type {[value: "magnitude" | "phase", text: string][]} */ ([
      ["magnitude", "dB"],
      ["phase", "°"],
    ]),
    (value) => {
      tracking.what = value;
      tracking.build();
      page.dirty.add("rows");
    },
  );
  const over = new Option(
    $("tracking-over"),
    "over",
    /** @type {[value: "time" | "position", text: string][]} */ ([
      ["time", tr("time")],
      ["position", tr("position")],
    ]),
    (value) => {
      tracking.over = value;
      tracking.build();
      page.dirty.add("rows");
    },
  );
  new Option($("tracking-span"), "span", SPANS, (value) => {
    page.spanS = value;
    page.rows.clear();
    fill();
  });
  new Option(
    $("map-what"),
    "map",
    /** @type {[value: import("./map-cells.js").Shown, text: string][]} */ ([
      ["level", tr("level")],
      ["change", tr("change")],
      ["coherence", "γ²"],
    ]),
    (value) => {
      map.what = value;
      map.paint();
      page.dirty.add("rows");
    },
  );
  const mapOver = new Option(
    $("map-over"),
    "map-over",
    /** @type {[value: "position" | "time", text: string][]} */ ([
      ["position", tr("position")],
      ["time", tr("time")],
    ]),
    (value) => {
      map.over = value;
      page.dirty.add("rows");
    },
  );
  const picture = new Option(
    $("signals-picture"),
    "signals",
    /** @type {[value: "time" | "spectrum", text: string][]} */ ([
      ["time", tr("over time")],
      ["spectrum", tr("spectrum")],
    ]),
    (value) => {
      signals.picture = value;
    },
  );
  /** @param {"time" | "spectrum"} value */
  const showSignals = (value) => {
    picture.choose(value);
    tab("signals");
  };
  const enlarge = enlarging($("enlarge"));
  const nextKind = kinds(bode, complain);
  tab(
    chosen(
      "tab",
      "map",
      TABS.map(([value]) => value),
    ),
  );

  const title = () => page.facts?.name ?? "";
  const stem = () =>
    `${title()}-${page.quantity?.replace(" ", "-")}-${stamp(bode.curves.measured?.frame?.timeS[0] ?? tracking.toS)}`;
  /**
   * @param {"csv" | "mat"} format
   * @param {boolean} whole
   */
  const query = (format, whole) => {
    const at = bode.curves.measured?.frame?.timeS[0] ?? timeline.span.last_s;
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
  const plot = plots(page, { bode, tracking, map });
  printed(plot, () => Boolean(page.facts?.begun && bode.curves.measured));
  const menu = new Menu($("download"), $("download-menu"), [
    [
      tr("picture (PNG) of the Bode plot, the tracking or the map"),
      ready(exportDialog(plot, (name) => (name === "bode" ? stem() : `${stem()}-${name}`), complain)),
    ],
    [tr("this response as CSV"), ready(() => get("csv", false))],
    [tr("this response as .mat"), ready(() => get("mat", false))],
    [tr("all responses in the time span as CSV"), ready(() => get("csv", true))],
    [tr("all responses in the time span as .mat"), ready(() => get("mat", true))],
  ]);
  const axis = $("axis", HTMLSelectElement);
  axis.addEventListener("change", () => {
    axisChosen(Number(axis.value));
    references.releaseAll();
    clear();
    watchShown();
  });
  $("freeze").addEventListener("click", () => references.freeze());
  $("share").addEventListener("click", () => copyLink(complain));
  $("theme").addEventListener("click", nextTheme);
  const languages = $("language", HTMLSelectElement);
  const names = Object.entries(language.languages);
  languages.append(...names.map(([value, name]) => element("option", { value, lang: value }, name)));
  languages.value = language.code;
  languages.addEventListener("change", () => chooseLanguage(languages.value));
  heightKeys(bode);
  mapKeys(map);
  planeKeys(bode, $("plane"));
  const lines = table(bode);
  $("bode-table").addEventListener("click", lines);
  const help = $("keys", HTMLDialogElement);
  $("help").addEventListener("click", () => help.showModal());
  /** @param {number} i */
  const nth = (i) => () => {
    const q = page.facts?.begun && page.facts.quantities[i];
    if (q) watch(q.name, worded(q.why_not));
  };
  keys(
    $("keys-list"),
    [
      [["?"], tr("this help"), () => help.showModal()],
      [[" "], tr("play, pause or resume"), () => timeline.toggle()],
      [["←", "→"], tr("move the cursor to the next line"), null],
      [[",", "."], tr("{seconds} s backward or forward in the record", { seconds: fixed(0.1, 1) }), null],
      [["1", "2", "3", "4"], tr("plant, open loop, closed loop, sensitivity"), null],
      [["F"], tr("freeze this curve as a reference"), () => references.freeze()],
      [["U"], tr("release the newest reference"), () => references.releaseNewest()],
      [["M", "P", "G"], tr("map, parameters, margins"), null],
      [["O", "Q"], tr("signals over time, their spectrum"), null],
      [["E"], tr("enlarge or reduce the map, the parameters, the margins or the signals"), enlarge],
      [["A"], tr("list of alarms"), () => events.openAlarms()],
      [["↑", "↓", "Enter"], tr("in the list: move, and show the moment of the alarm"), null],
      [["K", "Shift+K"], tr("in the list: acknowledge, without or with a comment"), null],
      [["S"], tr("in the list: shelve or unshelve"), null],
      [["W"], tr("wall mode; Escape ends it"), () => wall.toggle()],
      [["D"], tr("download"), () => menu.show(true)],
      [["V"], tr("Bode plot, Nyquist plot or Nichols chart"), nextKind],
      [["0"], tr("show the whole Bode plot"), () => bode.reset()],
      [["+", "-"], tr("zoom the Bode plot around the cursor"), null],
      [["H", "J"], tr("move the visible band to the left or right"), null],
      [["X", "Y"], tr("fix cursor A or B at the line under the cursor"), null],
      [["C"], tr("remove the fixed cursors and the peak"), () => bode.unplace()],
      [["B", "N"], tr("previous or next peak or antiresonance"), null],
      [["R"], tr("all lines as a table"), ready(lines)],
      [["↑", "↓"], tr("in a plot: move its vertical axis; on the map: move from line to line"), null],
      [["PageUp", "PageDown"], tr("in a plot: zoom its vertical axis"), null],
      [["T"], tr("light or dark"), nextTheme],
      [["Z"], tr("clock: time zone of this browser, UTC, time of the run"), nextClock],
      [["L"], tr("copy a link to this view"), () => copyLink(complain)],
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
      O: () => showSignals("time"),
      Q: () => showSignals("spectrum"),
      "+": () => bode.magnify(true),
      "-": () => bode.magnify(false),
      H: () => bode.shift(-0.25),
      J: () => bode.shift(0.25),
      X: () => bode.place(false),
      Y: () => bode.place(true),
      B: () => bode.seek(false),
      N: () => bode.seek(true),
    },
  );
  return { over, mapOver };
}
