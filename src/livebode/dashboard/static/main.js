// @ts-check
// The page: messages from the server go to the panels, actions of the person go to the server.
import { ADDITIONS } from "./additions.js";
import { chosen, enter, remember, link as shownAddress } from "./address.js";
import { alarmMoment } from "./alarmmoment.js";
import { Bode } from "./bode.js";
import { onClock, setClock } from "./clock.js";
import { controls } from "./controls.js";
import { curvesMenu } from "./curves-menu.js";
import { describe } from "./describe.js";
import { Events } from "./events.js";
import { delayMs, marginMarks, modes } from "./fitted.js";
import { folds } from "./fold.js";
import { framesOf, QUANTITIES } from "./frames.js";
import { health } from "./health.js";
import { tr } from "./language.js";
import { legend } from "./legend.js";
import { Link } from "./link.js";
import { firstLook } from "./look.js";
import { Lost } from "./lost.js";
import { byId as $, choose, element, segments } from "./make.js";
import { LineMap } from "./map.js";
import { isMargin, Margins, marginWords as marginTitle } from "./margins.js";
import { marginWords } from "./marks.js";
import { notable } from "./notable.js";
import { past } from "./past.js";
import { readout } from "./readout.js";
import { References } from "./references.js";
import { resultWords } from "./result.js";
import { Rows } from "./rows.js";
import { Saved } from "./saved.js";
import { axisInAddress, rememberAxis, rememberMoment, timeInAddress } from "./shared.js";
import { Signals } from "./signals.js";
import { applyTheme } from "./theme.js";
import { TimeZoom } from "./time-zoom.js";
import { Timeline } from "./timeline.js";
import { tools } from "./tools.js";
import { Tracking } from "./tracking.js";
import { Trends } from "./trends.js";
import { lamp } from "./verdict.js";
import { viewMenu } from "./view-menu.js";
import { Wall } from "./wall.js";
import { worded } from "./worded.js";
import { named } from "./words.js";
import { zoneChoice } from "./zone.js";

/** @import { Beginning, Fits, Frame, Page, Part, Quantity, Run } from "./messages.js" */

const TEXT_MS = 120,
  TRACK_MS = 100,
  MAP_MS = 600;
const NO_POSITION = tr("This run has no position: name its channel as schedule under [signals].");
const REFERENCE_GONE = tr("A new run with other lines or another quantity has started: the references were released.");

applyTheme();
folds();
/** @type {Page} */
const page = {
  axis: 0,
  quantity: QUANTITIES.find((q) => q === chosen("quantity", String())) ?? null,
  spanS: "20",
  tab: "map",
  up: false,
  facts: null,
  health: null,
  verdicts: [],
  schedule: { name: "", unit: "" },
  rows: new Rows(1),
  past: null,
  zoom: null,
  seen: null,
  read: null,
  dirty: new Set(),
  last: {},
  key: null,
  measured: null,
  seeking: false,
};
// First, so that it connects while the panels are made; its messages come after that.
const link = new Link({
  onState: (up) => {
    page.up = up;
    if (!up) status();
  },
  onNews: (news) => {
    const beginning = news.facts ? news : null;
    // Until the facts of the axis in the address arrive, what comes belongs to another one.
    if (beginning ? overtaken(beginning) || elsewhere(beginning) : !page.facts) return;
    if (news.error) complain(worded(news.words ?? news.error));
    if (news.span && setClock(news.span.clock, news.span.start_s ?? 0)) newClock();
    if (beginning) begin(beginning);
    if (news.span) {
      timeline.take(news.span);
      zoom.renew();
      restore(news.span);
    }
    if (news.health && page.facts?.begun) {
      page.health = news.health;
      health($("health"), news.health, page.facts, timeline.span);
      margins.lines = news.health.ms_at_lines;
      page.dirty.add("fits");
    }
    if (news.verdicts) page.verdicts = news.verdicts;
    events.nowS = timeline.span.last_s;
    if (news.notices) events.take(news.notices, news.history, news.forgotten);
    if (news.newest) {
      for (const trend of news.newest) {
        parameters.take(trend);
        marginTrends.take(trend);
      }
      page.dirty.add("trends");
    }
    status();
  },
  onBytes: (data) => {
    for (const frame of framesOf(data)) takeFrame(frame);
  },
});

const axisChoice = $("axis", HTMLSelectElement);
const bode = new Bode(
  [$("magnitude"), $("phase"), $("coherence")],
  (hz, found) => {
    page.read = [hz, found];
    page.dirty.add("read");
  },
  {
    margins: () => marginMarks(margins.items),
    laid: () => {
      drawLegend();
      page.dirty.add("rows");
    },
    modes: () => modes(parameters.items.values()),
  },
);
const tracking = new Tracking($("tracking"), $("tracking-lines"), bode.view);
const map = new LineMap($("map", HTMLCanvasElement), $("map-hover"), bode.view);
const parameters = new Trends(
  $("pane-parameters"),
  (t) => t.model !== "margins",
  tr("No model is fitted: add [fit] to the configuration."),
);
const margins = new Margins($("margins"));
const marginTrends = new Trends($("margin-trends"), isMargin, "", marginTitle);
const events = new Events(
  {
    host: $("events"),
    views: $("events-view"),
    filter: $("events-filter", HTMLInputElement),
    count: $("alarm-count"),
  },
  (text) => complain(text),
  (cause, timeS) => showAlarm(events.all.get(cause), timeS),
);
const wall = new Wall($("wall"), page, () => bode.rebuild());
const timeline = new Timeline(
  {
    slider: $("time", HTMLInputElement),
    pause: $("pause"),
    from: $("time-from"),
    to: $("time-to"),
    now: $("time-now"),
  },
  {
    drawnS: () => bode.curves.measured?.frame?.timeS[0],
    onMoment: (timeS) => {
      rememberMoment(timeS);
      showMoment(timeS);
      for (const part of Object.values(additions)) part.moment?.();
    },
    onLive: () => {
      rememberMoment(null);
      goLive();
      for (const part of Object.values(additions)) part.moment?.();
    },
  },
);

/** @param {string} text */
function complain(text) {
  $("notice").textContent = text;
  $("notice").hidden = !text;
  clearTimeout(page.silence);
  page.silence = setTimeout(() => {
    $("notice").hidden = true;
  }, 8000);
}

/** @param {Frame | Fits} frame */
function takeFrame(frame) {
  if (!page.facts?.begun || frame.axis !== page.axis || frame.quantity !== page.quantity) return;
  if (frame.kind === "rows") {
    page.rows.take(frame);
    page.dirty.add("rows");
    return;
  }
  if (!frame.kind.startsWith("reference") && timeline.atS !== null) return;
  if (frame.kind === "fits") showFits(frame);
  else {
    bode.take(frame);
    page.dirty.add("bode");
  }
}

/** What is printed of the fits; the model of the same fit is drawn in the same frame of the screen. @param {Fits} fits */
function showFits({ trends }) {
  for (const shown of [parameters, margins, marginTrends]) shown.show(trends);
  page.dirty.add("bode").add("fits");
}

/**
 * An answer to an earlier request; it would undo the choice of another axis.
 *
 * @param {Beginning} news
 */
const overtaken = ({ facts, axes }) =>
  page.wanted !== undefined && page.wanted < axes.length && facts.axis !== page.wanted;

/**
 * Whether the address names another axis, which is requested now.
 *
 * @param {Beginning} news
 */
function elsewhere(news) {
  const other = page.wanted === undefined ? axisInAddress(news, complain) : null;
  page.wanted ??= news.facts.axis;
  if (other === null) return false;
  page.axis = page.wanted = other;
  link.request({ kind: "watch", axis: other, quantity: null }, "watch");
  return true;
}

let restored = false;
/**
 * Show the moment and the span of the address, as soon as their run is there.
 *
 * @param {import("./messages.js").Span} span
 */
function restore(span) {
  if (restored || !page.facts?.begun || span.last_s === null || span.first_s === null) return;
  restored = true;
  zoom.restore(span, complain);
  const timeS = timeInAddress("at", span, complain);
  if (Number.isFinite(timeS)) timeline.go(timeS);
}

/**
 * A person has chosen another axis; what belonged to the one before leaves the address.
 *
 * @param {number} axis
 */
function axisChosen(axis) {
  page.axis = page.wanted = axis;
  page.quantity = null;
  timeline.stop();
  timeline.atS = null;
  page.zoom = null;
  link.forget("pause");
  link.request({ kind: "resume" });
  rememberAxis(
    Array.from(axisChoice.options, ({ text }) => text),
    axis,
  );
  for (const name of ["quantity", "lines", "at", "from", "to"]) remember(name, "", "");
  zoom.draw();
}

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
  axisChoice.value = String(facts.axis);
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
  const refused = page.quantity && !fits ? whyNot(facts, page.quantity) : "";
  if (refused) remember("quantity", "", "");
  const key = JSON.stringify([facts.axis, facts.frequency_hz, fits ? page.quantity : facts.quantity]);
  page.quantity = fits ? page.quantity : facts.quantity;
  page.axis = facts.axis;
  page.schedule = named(facts.schedule);
  document.title = `${facts.name} · livebode`;
  showQuantities(facts);
  if (page.key !== key) {
    page.key = key;
    page.rows = new Rows(facts.frequency_hz.length);
    page.past = null;
    bode.begin(facts, page.quantity ?? facts.quantity);
    tracking.begin(facts, page.schedule);
    map.begin(facts, page.schedule);
    fill();
    saved.fetch();
    page.dirty.add("additions");
  }
  const gone = other && references.stored.size > 0;
  if (gone) references.releaseAll();
  if (!page.restored) references.restore();
  page.restored = true;
  over.permit("position", Boolean(facts.schedule));
  mapOver.permit("position", Boolean(facts.schedule));
  drawLegend();
  for (const part of Object.values(additions)) part.begin();
  parameters.begin(trends);
  margins.begin(whyNoMargins(facts));
  marginTrends.begin(trends);
  events.begin(facts.axis, facts.role === "operator" && facts.live);
  const unplaced = !facts.schedule && over.wanted === "position" ? NO_POSITION : "";
  const remarks = [gone ? REFERENCE_GONE : "", refused, unplaced, worded(facts.remark)].filter(Boolean);
  if (remarks.length) complain(remarks.join(" "));
  if (timeline.atS !== null) showMoment(timeline.atS);
  if (facts.watched !== page.quantity) watchShown();
}

/** Those that this run has; a button gives the reason why the others are absent. @param {Run} facts */
function showQuantities({ quantities }) {
  const [known, absent] = [quantities.filter((q) => !q.why_not), quantities.filter((q) => q.why_not)];
  segments(
    $("quantities"),
    known.map(({ name, symbol }) => ({ value: name, text: `${worded(name)} ${symbol}` })),
    page.quantity,
    watch,
  );
  const button = $("absent");
  button.hidden = !absent.length;
  button.textContent = tr("no {symbols}: why?", { symbols: absent.map(({ symbol }) => symbol).join(", ") });
  button.onclick = () => complain([...new Set(absent.map(({ why_not: why }) => worded(why)))].join(" "));
}

/**
 * @param {Run} facts
 * @param {string} quantity
 */
function whyNot({ quantities }, quantity) {
  const why = quantities.find(({ name }) => name === quantity)?.why_not;
  return why ? `${worded(quantity)}: ${worded(why)}` : tr("{quantity} is not a quantity of this page.", { quantity });
}

// Another axis was chosen, whose machine may not have sent anything: clear the page.
function clear() {
  Object.assign(page, { key: null, measured: null, past: null, seen: null, read: null, health: null });
  if (page.facts)
    page.facts = { ...page.facts, begun: false, name: axisChoice.selectedOptions[0]?.text ?? page.facts.name };
  page.rows.clear();
  for (const panel of [bode, tracking, map, signals]) panel.clear();
  for (const id of ["health", "readout", "quantities", "result"]) $(id).replaceChildren();
  $("absent").hidden = true;
  parameters.begin([]);
  margins.clear();
  margins.begin(tr("No samples have arrived yet."));
  marginTrends.begin([]);
  events.begin(page.axis, false);
  timeline.take({ first_s: null, last_s: null, live: false, growing: false });
  status();
}

// All displayed times follow the new clock.
function newClock() {
  showClock();
  status();
  events.redraw();
  timeline.draw();
  tracking.build();
  signals.redraw();
  parameters.refresh();
  marginTrends.refresh();
  page.dirty.add("bode").add("read").add("rows").add("trends");
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
    complain(`${worded(quantity)}: ${why}`);
    return;
  }
  if (quantity === page.quantity) return;
  page.quantity = quantity;
  enter();
  remember("quantity", quantity, (page.facts?.begun && page.facts.quantity) || "");
  choose($("quantities"), quantity);
  page.key = null;
  watchShown();
}

function status() {
  const { up, facts, health } = page;
  if (!facts) return;
  const known = { up, facts, health };
  lost.show(known, timeline.span.live && timeline.atS === null);
  document.body.classList.toggle("not-begun", !facts.begun);
  const [word, look] = lamp({ ...known, over: lost.over }, timeline.span, timeline.atS !== null && timeline.following);
  $("lamp").className = `lamp ${look}`;
  // The long name of an entry is in the choice beside it: twice there, the header would need a second row.
  $("status-text").textContent = facts.begun && facts.matrix ? word : `${facts.name} · ${word}`;
  $("status").title = facts.name;
  firstLook(page, up || lost.over);
  wall.draw();
}

const drawLegend = () => legend($("legend"), bode, page.facts, references.names);

// References, saved curves or annotations have changed.
function curvesChanged() {
  page.dirty.add("bode").add("read");
  drawLegend();
  curves?.fill();
}

let aimedAt = "";
/** The first cursor and the tracked lines are where the response has something to show. @param {Run} facts */
function aim(facts) {
  if (!bode.curves.measured || aimedAt === page.key) return;
  const { resonances, antiresonances, crossovers, fitted } = notable(bode);
  if (fitted || !facts.model) aimedAt = page.key ?? "";
  tracking.suggest([...resonances, ...antiresonances, ...crossovers]);
  if (bode.aimed || !resonances.length) return;
  bode.go(resonances[0]);
  bode.aimed = fitted || !facts.model;
}

function showMargins() {
  const words = marginWords(bode);
  if ($("margin-words").textContent === words) return;
  $("margin-words").textContent = words;
  $("margin-words").hidden = !words;
}

/** @param {Run} facts */
function showResult(facts) {
  const words = resultWords(facts, bode, parameters);
  if ($("result").textContent !== words) $("result").textContent = words;
}

/** @param {number} now */
function draw(now) {
  requestAnimationFrame(draw);
  if (!page.facts?.begun || !bode.charts.length) return;
  /**
   * @param {Part} what
   * @param {number} ms
   */
  const due = (what, ms) => {
    if (!page.dirty.has(what) || now - (page.last[what] ?? -1e9) < ms) return false;
    page.dirty.delete(what);
    page.last[what] = now;
    return true;
  };
  if (due("bode", 0)) {
    bode.draw();
    aim(page.facts);
    showMargins();
  }
  if (due("fits", 0)) {
    showResult(page.facts);
    margins.draw(timeline.atS !== null); // on paper it is shown in every tab
  }
  if (due("additions", 0)) for (const part of Object.values(additions)) part.draw();
  if (due("read", TEXT_MS)) {
    if (page.read) readout($("readout"), ...page.read, page.schedule, bode);
    showResult(page.facts);
  }
  if (due("rows", TRACK_MS)) drawRows(now);
  if (page.seen && due("map", timeline.atS === null ? MAP_MS : 0)) {
    map.draw(...page.seen);
    if (map.cells && page.facts?.schedule) mapOver.permit("position", map.cells.moved);
  }
  if (due("trends", 250)) {
    if (page.tab === "parameters") parameters.draw(page.zoom);
    if (page.tab === "margins") marginTrends.draw(page.zoom);
  }
}

const { fill, showMoment, goLive, drawRows } = past(
  page,
  { bode, tracking, timeline, link },
  { complain, status, showFits },
);
const references = new References(bode, link, { changed: curvesChanged, complain });
const saved = new Saved(() => page.axis, {
  changed: (annotations) => {
    bode.annotations = annotations;
    curvesChanged();
  },
  complain,
});
const zoom = new TimeZoom(page, tracking, timeline, $("zoomed"), fill);
const signals = new Signals({ words: $("signals-words"), charts: $("signals") }, page, timeline, bode.view);
const parts = { bode, tracking, map, signals, timeline, events, wall, references };
const { over, mapOver } = controls(page, parts, { watch, fill, watchShown, clear, complain, axisChosen });
const showAlarm = alarmMoment(page, timeline, { references, complain });
tools($("bode-tools"), bode);
viewMenu($("bode-view"), $("bode-view-panel"), bode, () => delayMs(parameters.items.values()));
/** @param {number} axis */
const chooseAxis = (axis) => {
  axisChoice.value = String(axis);
  axisChoice.dispatchEvent(new Event("change"));
};
const additions = Object.fromEntries(
  Object.entries(ADDITIONS).map(([name, added]) => [
    name,
    added(page, bode, { timeline, watch, choose: chooseAxis, complain }),
  ]),
);
const operator = () => page.facts?.role === "operator";
const curves = curvesMenu($("bode-curves"), $("bode-curves-panel"), { bode, references, saved, operator, complain });
const showClock = zoneChoice($("clock", HTMLSelectElement));
const lost = new Lost($("lost"));
describe(page, { bode, tracking, map, trends: [parameters, marginTrends] });
onClock(newClock);
window.livebode = { page, ...parts, parameters, margins, marginTrends, saved, zoom, shownAddress, ...additions };
requestAnimationFrame(draw);
