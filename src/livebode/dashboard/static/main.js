// @ts-check
// The page: messages from the server go to the panels, actions of the person go to the server.
import { Bode } from "./bode.js";
import { setClock } from "./clock.js";
import { controls } from "./controls.js";
import { Events } from "./events.js";
import { health } from "./health.js";
import { tr } from "./language.js";
import { Link } from "./link.js";
import { byId as $, choose, element, segments } from "./make.js";
import { LineMap } from "./map.js";
import { Margins } from "./margins.js";
import { past } from "./past.js";
import { readout } from "./readout.js";
import { recognised } from "./recognition.js";
import { Rows } from "./rows.js";
import { applyTheme } from "./theme.js";
import { Timeline } from "./timeline.js";
import { Tracking } from "./tracking.js";
import { Trends } from "./trends.js";
import { lamp, verdict } from "./verdict.js";
import { named } from "./words.js";

/** @import { Beginning, Curves, Page, Quantity, Run } from "./messages.js" */

const TEXT_MS = 120,
  TRACK_MS = 100,
  MAP_MS = 600;
const REFERENCE_GONE = tr(
  "A new run with other lines or another quantity has started: the frozen reference was released.",
);
/** @type {[name: Curves, words: string, line: string][]} */
const LEGEND = [
  ["measured", tr("measured ±3σ"), ""],
  ["reference", tr("reference"), "dashed"],
  ["baseline", tr("baseline"), "dotted"],
  ["model", tr("fitted model"), "dashed"],
];

applyTheme();
/** @type {Page} */
const page = {
  axis: 0,
  quantity: null,
  spanS: "20",
  tab: "map",
  up: false,
  facts: null,
  health: null,
  schedule: { name: "", unit: "" },
  frozen: false,
  rows: new Rows(1),
  past: null,
  seen: null,
  read: null,
  dirty: new Set(),
  last: {},
  key: null,
  measured: null,
  seeking: false,
};
const axisChoice = $("axis", HTMLSelectElement);
const bode = new Bode([$("magnitude"), $("phase"), $("coherence")], (hz, found) => {
  page.read = [hz, found];
  page.dirty.add("read");
});
const tracking = new Tracking($("tracking"), $("tracking-lines"), (timeS) => timeline.go(timeS));
const map = new LineMap($("map", HTMLCanvasElement), $("map-hover"));
const parameters = new Trends(
  $("pane-parameters"),
  (t) => t.model !== "margins",
  tr("No model is fitted: add [fit] to the configuration."),
);
const margins = new Margins($("pane-margins"));
const events = new Events($("events"), $("alarms-only", HTMLInputElement), $("alarm-count"), (text) => complain(text));
const timeline = new Timeline(
  {
    slider: $("time", HTMLInputElement),
    pause: $("pause"),
    from: $("time-from"),
    to: $("time-to"),
    now: $("time-now"),
  },
  { onMoment: (timeS) => showMoment(timeS), onLive: () => goLive() },
);

/** @param {string} text */
function complain(text) {
  $("notice").textContent = recognised(text);
  $("notice").hidden = !text;
  clearTimeout(page.silence);
  page.silence = setTimeout(() => {
    $("notice").hidden = true;
  }, 8000);
}

const link = new Link({
  onState: (up) => {
    page.up = up;
    if (!up) status();
  },
  onNews: (news) => {
    const beginning = news.facts ? news : null;
    if (beginning && overtaken(beginning)) return;
    if (news.error) complain(news.error);
    if (news.span && setClock(news.span.clock)) newClock();
    if (beginning) begin(beginning);
    if (news.span) timeline.take(news.span);
    if (news.health && page.facts?.begun) {
      page.health = news.health;
      health($("health"), news.health, page.facts, timeline.span);
      margins.lines = news.health.ms_at_lines;
      page.dirty.add("trends");
    }
    if (news.notices) events.take(news.notices);
    if (news.newest) {
      for (const trend of news.newest) {
        parameters.take(trend);
        margins.take(trend);
      }
      page.dirty.add("trends");
    }
    status();
  },
  onFrame: (frame) => {
    if (!page.facts?.begun || frame.axis !== page.axis || frame.quantity !== page.quantity) return;
    if (frame.kind === "rows") {
      page.rows.take(frame);
      page.dirty.add("rows");
      return;
    }
    if (frame.kind !== "reference" && timeline.atS !== null) return;
    bode.take(frame);
    page.dirty.add("bode");
  },
});

/**
 * An answer to an earlier request; it would undo the choice of another axis.
 *
 * @param {Beginning} news
 */
const overtaken = ({ facts, axes }) =>
  page.wanted !== undefined && page.wanted < axes.length && facts.axis !== page.wanted;

/**
 * The axis or its quantity has changed, the run has started, or the link is new.
 *
 * @param {Beginning} news
 */
function begin({ facts, axes, trends }) {
  page.facts = facts;
  $("axis-label").hidden = axes.length < 2;
  if (axisChoice.options.length !== axes.length)
    axisChoice.replaceChildren(...axes.map((name, i) => element("option", { value: i }, name)));
  if (!facts.begun) {
    page.axis = facts.axis;
    document.title = `${facts.name} · livebode`;
    clear();
    return;
  }
  const measured = JSON.stringify([facts.frequency_hz, facts.quantity]);
  const other = page.axis === facts.axis && page.measured !== measured;
  page.measured = measured;
  const fits = facts.quantities.find((q) => q.name === page.quantity && !q.why_not);
  const key = JSON.stringify([facts.axis, facts.frequency_hz, fits ? page.quantity : facts.quantity]);
  page.quantity = fits ? page.quantity : facts.quantity;
  page.axis = facts.axis;
  page.schedule = named(facts.schedule);
  document.title = `${facts.name} · livebode`;
  segments(
    $("quantities"),
    facts.quantities.map(({ name, symbol, why_not: why }) => ({
      value: name,
      text: `${recognised(name)} ${symbol}`,
      why: why && recognised(why),
    })),
    page.quantity,
    watch,
  );
  if (page.key !== key) {
    const shown = facts.quantities.find((q) => q.name === page.quantity);
    page.key = key;
    page.rows = new Rows(facts.frequency_hz.length);
    page.past = null;
    bode.begin(facts, shown?.unit ?? "", shown?.symbol ?? "");
    tracking.begin(facts, page.schedule);
    map.begin(facts, page.schedule);
    fill();
  }
  const gone = other && page.frozen;
  if (gone) letGo();
  legend();
  parameters.begin(trends);
  margins.begin(trends, whyNoMargins(facts));
  events.begin(facts.axis, facts.role === "operator" && facts.live);
  const remarks = [gone ? REFERENCE_GONE : "", facts.remark].filter(Boolean);
  if (remarks.length) complain(remarks.join(" "));
  if (timeline.atS !== null) showMoment(timeline.atS);
  if (facts.watched !== page.quantity) watchShown();
}

// Another axis was chosen, whose machine may not have sent anything: clear the page.
function clear() {
  Object.assign(page, { key: null, measured: null, past: null, seen: null, read: null, health: null });
  if (page.facts)
    page.facts = { ...page.facts, begun: false, name: axisChoice.selectedOptions[0]?.text ?? page.facts.name };
  page.rows.clear();
  for (const panel of [bode, tracking, map]) panel.clear();
  for (const id of ["health", "readout", "quantities"]) $(id).replaceChildren();
  parameters.begin([]);
  margins.lines = null;
  margins.begin([], tr("No samples have arrived yet."));
  events.begin(page.axis, false);
  timeline.take({ first_s: null, last_s: null, live: false, growing: false });
  status();
}

// All displayed times follow the new clock.
function newClock() {
  events.draw();
  for (const what of ["bode", "rows", "trends"]) page.dirty.add(what);
}

/** @param {Run} facts */
const whyNoMargins = (facts) =>
  facts.quantities.find((q) => q.name === "open loop")?.why_not
    ? tr("Margins need the loop: describe its controllers under [loop].")
    : tr("Margins need a fitted model: add [fit] to the configuration.");

const watchShown = () => link.request({ kind: "watch", axis: page.axis, quantity: page.quantity }, "watch");

/**
 * @param {Quantity} quantity
 * @param {string} [why] it cannot be shown
 */
function watch(quantity, why) {
  if (why) {
    complain(`${recognised(quantity)}: ${recognised(why)}`);
    return;
  }
  if (quantity === page.quantity) return;
  page.quantity = quantity;
  choose($("quantities"), quantity);
  page.key = null;
  watchShown();
}

function status() {
  const { up, facts, health } = page;
  if (!facts) return;
  const known = { up, facts, health };
  const [word, look] = lamp(known, timeline.span, timeline.atS !== null);
  $("lamp").className = `lamp ${look}`;
  $("status-text").textContent = `${facts.name} · ${word}`;
  const [judged, tone, why] = verdict(known, events.open, look);
  Object.assign($("verdict"), { textContent: judged, className: `verdict ${tone}`, title: why, hidden: false });
}

function legend() {
  const { facts } = page;
  const hidden = {
    measured: false,
    reference: !page.frozen,
    baseline: !(facts?.begun && facts.baseline),
    model: !(facts?.begun && facts.model),
  };
  $("legend").replaceChildren(
    ...LEGEND.map(([name, words, line]) => {
      const swatch = element("span", { class: `swatch ${line}`, "aria-hidden": "true" });
      swatch.style.color = `var(--${name})`;
      const made = element(
        "button",
        {
          type: "button",
          "aria-pressed": String(bode.shown.has(name)),
          "data-name": name,
          onclick: () => {
            bode.toggle(name, !bode.shown.has(name));
            legend();
          },
        },
        swatch,
        words,
      );
      made.hidden = hidden[name];
      return made;
    }),
  );
}

// Freeze the response that is shown as a reference, or release the frozen one.
function freeze() {
  if (page.frozen) {
    letGo();
    return;
  }
  const timeS = bode.curves.measured?.frame.timeS[0];
  if (timeS === undefined) return;
  link.request({ kind: "freeze", time_s: timeS }, "freeze");
  frozen(true);
}

function letGo() {
  link.forget("freeze");
  link.request({ kind: "unfreeze" });
  bode.drop("reference");
  page.dirty.add("bode");
  frozen(false);
}

/** @param {boolean} is */
function frozen(is) {
  page.frozen = is;
  $("freeze").textContent = is ? tr("Unfreeze") : tr("Freeze");
  $("freeze").classList.toggle("primary", is);
  legend();
}

/** @param {number} now */
function draw(now) {
  requestAnimationFrame(draw);
  if (!page.facts?.begun || !bode.charts.length) return;
  /**
   * @param {string} what
   * @param {number} ms
   */
  const due = (what, ms) => {
    if (!page.dirty.has(what) || now - (page.last[what] ?? -1e9) < ms) return false;
    page.dirty.delete(what);
    page.last[what] = now;
    return true;
  };
  if (due("bode", 0)) bode.draw();
  if (due("read", TEXT_MS) && page.read) readout($("readout"), ...page.read, page.schedule);
  if (due("rows", TRACK_MS)) drawRows(now);
  if (page.tab === "map" && page.seen && due("map", timeline.atS === null ? MAP_MS : 0)) map.draw(...page.seen);
  if (due("trends", 250)) {
    if (page.tab === "parameters") parameters.draw(timeline.atS ?? NaN);
    if (page.tab === "margins") margins.draw(timeline.atS ?? NaN);
  }
}

const { fill, showMoment, goLive, drawRows } = past(page, { bode, tracking, timeline, link }, { complain, status });
controls(page, { bode, tracking, map, timeline }, { watch, freeze, fill, watchShown, clear, complain });
window.livebode = { page, bode, tracking, map, parameters, margins, events, timeline };
requestAnimationFrame(draw);
