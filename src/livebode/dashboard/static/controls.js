// @ts-check
// Buttons, tabs, downloads and keys.
import { moment } from "./clock.js";
import { Menu, numbers, picture } from "./download.js";
import { keys } from "./keys.js";
import { reason } from "./link.js";
import { byId as $, choose, element, segments } from "./make.js";
import { nextTheme } from "./theme.js";

/** @import { Page, Quantity } from "./messages.js" */

/** @type {[value: string, text: string][]} */
const TABS = [
  ["map", "Map"],
  ["parameters", "Parameters"],
  ["margins", "Margins"],
];
/** @type {[value: string, text: string][]} */
const SPANS = [
  ["20", "20 s"],
  ["120", "2 min"],
  ["whole", "all"],
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
 * @param {() => void} actions.say
 * @param {() => void} actions.clear
 * @param {(text: string) => void} actions.complain
 */
export function controls(page, { bode, tracking, map, timeline }, { watch, freeze, fill, say, clear, complain }) {
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
      ["time", "time"],
      ["position", "position"],
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
      ["level", "level"],
      ["change", "change"],
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
  const ready = (act) => () => (page.facts?.begun ? act() : complain("The run has not started."));
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
      "Bode plot as PNG",
      ready(() =>
        picture(
          `${stem()}.png`,
          `${title()}: ${page.quantity}`,
          `at ${moment(bode.curves.measured?.frame.timeS[0], true)}, bands are ±3σ`,
          bode.charts,
        ),
      ),
    ],
    ["this response as CSV", ready(() => get("csv", false))],
    ["this response as .mat", ready(() => get("mat", false))],
    ["all responses in the time span as CSV", ready(() => get("csv", true))],
    ["all responses in the time span as .mat", ready(() => get("mat", true))],
  ]);
  const axis = $("axis", HTMLSelectElement);
  axis.addEventListener("change", () => {
    page.axis = page.wanted = Number(axis.value);
    page.quantity = null;
    if (page.frozen) freeze();
    timeline.atS = null;
    clear();
    say();
  });
  $("freeze").addEventListener("click", freeze);
  $("theme").addEventListener("click", nextTheme);
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
      [["?"], "this help", () => help.showModal()],
      [[" "], "pause or resume", () => timeline.toggle()],
      [["←", "→"], "move the cursor to the next line", null],
      [[",", "."], "0.1 s backward or forward in the record", null],
      [["1", "2", "3", "4"], "plant, open loop, closed loop, sensitivity", null],
      [["F"], "freeze this curve as a reference, or release it", freeze],
      [["M", "P", "G"], "map, parameters, margins", null],
      [
        ["A"],
        "alarms only; go to the events",
        () => {
          $("alarms-only").click();
          $("events").focus();
        },
      ],
      [["D"], "download", () => menu.show(true)],
      [["0"], "full frequency band", () => bode.zoom(bode.whole)],
      [["T"], "light or dark", nextTheme],
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
