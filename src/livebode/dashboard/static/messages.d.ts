// Types of what the server sends (state.py, notices.py, recent.py, browser_socket.py) and of what the panels share.
import type { Bode } from "./bode.js";
import type { Curve } from "./curves.js";
import type { Mark } from "./marks.js";
import type { Rows } from "./rows.js";
import type { Timeline } from "./timeline.js";

export type Quantity = "plant" | "open loop" | "closed loop" | "sensitivity";
/** A stored response; the first one has no number. */
export type Reference = "reference" | `reference ${2 | 3 | 4 | 5 | 6 | 7 | 8}`;
/** `what if` and `result` are computed from others. */
export type Curves = "measured" | Reference | "baseline" | "model" | "what if" | "result";
export type FrameKind = "newest" | "moment" | Reference | "baseline" | "model" | "rows" | "history";
/** A number of the server; what is not finite is sent as null. */
export type Sent = number | null;

/** Curves of one or more responses: per row a time, per row and column a value; see frames.py. */
export interface Frame {
  kind: FrameKind;
  quantity: Quantity;
  axis: number;
  rows: number;
  columns: number;
  timeS: Float64Array;
  schedule: Float64Array;
  dof: Float64Array;
  magnitude: Float32Array;
  phase: Float32Array;
  reach: Float32Array;
  coherence: Float32Array;
  /** `reach` of the noise alone; this and the next only of the newest response and of a moment, else NaN. */
  noise: Float32Array;
  /** `reach` of noise and distortion; time variation is the rest. */
  distorted: Float32Array;
}

/** The fits that are shown together: one row of every parameter, of the fit whose model is in the same message. */
export interface Fits {
  kind: "fits";
  quantity: Quantity;
  axis: number;
  trends: Trend[];
}

/** Responses over time: the ring of the newest, or a frame of the record. */
export type History = Frame | Rows;

/** Name and unit of a channel. */
export interface Named {
  name: string;
  unit: string;
}

interface Axis {
  axis: number;
  name: string;
  live: boolean;
  role: "viewer" | "operator";
  watched: Quantity;
}

/** Facts of an axis whose run has not started. */
export interface Waiting extends Axis {
  begun: false;
}

/** Units of a quantity in the source, as `units`; its values there are `db` above those in SI units. */
export interface SourceUnits {
  units: string[];
  db: number;
}

/** Facts of a run. */
export interface Run extends Axis {
  begun: true;
  directory: string;
  version: string;
  frequency_hz: number[];
  grid_hz: number[];
  rate_hz: number;
  window: number;
  quantity: Quantity;
  /** `units` are those of the quantity times (jω)^n, n = −2 … 2. */
  quantities: {
    name: Quantity;
    symbol: string;
    unit: string;
    units: string[];
    drive: SourceUnits | null;
    why_not: Words;
  }[];
  /** Channels by role. */
  signals: Record<string, string | null>;
  schedule: string;
  model: string;
  baseline: boolean;
  remark: Words;
  /** of an entry of a matrix run; null of any other run */
  matrix: MatrixNames | null;
}

/** Signals of a matrix run; the axes of its entries follow the first one, output by output. */
export interface MatrixNames {
  name: string;
  outputs: string[];
  inputs: string[];
  first_axis: number;
}

export type Facts = Waiting | Run;

/** Span of time with data; pairs of `clock` are a second of the run and seconds since 1970 at its second 0. */
export interface Span {
  first_s: Sent;
  last_s: Sent;
  live: boolean;
  growing: boolean;
  start_s: Sent;
  clock: [number, number][];
}

export interface SourceHealth {
  connected: boolean;
  lost: number;
  latency_s: Sent;
  measured_hz: Sent;
  silent_s: Sent;
  waiting_bytes: number;
  waiting_s?: number;
}

export interface AtLines {
  value: number;
  bound: number;
  frequency_hz: number;
}

export interface Health {
  responses: number;
  responses_per_s: Sent;
  verdict: Verdict;
  ms_at_lines: AtLines | null;
  source?: SourceHealth | null;
  counts?: { samples: number; gaps: number } | null;
  samples?: number;
  gaps?: number;
  given_up?: number;
  /** No more samples are expected. */
  ending?: boolean;
  silent_s?: number;
  stale?: boolean;
  /** of tracking, if a person must know of it; see state.py */
  backlog_s?: Sent;
  behind_ms?: number;
  behind_p99_ms?: number;
  refused: number;
}

/** What has changed, and by how much. */
export interface AlarmFacts {
  what?: string;
  amount_percent?: number;
  bound_percent?: number;
  place_m?: number;
  reference?: string;
  name?: string;
  of?: string;
  amount?: number;
  unit?: string;
  entry?: string;
}

/** A fact of a message; a number as formatted in English. */
export type Fact =
  | Words
  | { number: string }
  | { list: Fact[] }
  | { unix_s: Sent; text: string };

/** A message of the server: its template and its facts, or a plain text; see worded.js. */
export type Words = string | [template: string, facts: Record<string, Fact>];

/** The most important thing on an axis; see verdict.py. */
export interface Verdict {
  tone: "alarm" | "check" | "ok" | "open";
  word: string;
  since_s: Sent;
  since_unix_s: Sent;
  seconds: Sent;
  facts: AlarmFacts;
  message: string;
  words: Words;
  count: number;
  cause: string;
  /** set by the page: not of the axis that is shown */
  other?: boolean;
}

export interface AxisVerdict extends Verdict {
  name: string;
  live: boolean;
}

/** State of an alarm; see alarm.py. */
export interface Alarm {
  state: "unacknowledged" | "acknowledged" | "returned" | "normal" | "shelved" | "suppressed";
  priority: "high" | "medium" | "low";
  since_s: number;
  at_s: number;
  returned_s: Sent;
  facts: AlarmFacts;
  by: string;
  comment: string;
  chatters_until_s: Sent;
  shelf: { by: string; until_s: number; reason: string } | null;
}

/** A change of an alarm; see alarm.py. */
export interface Transition {
  number: number;
  time_s: number;
  cause: string;
  kind: string;
  message: string;
  words: Words;
  what: string;
  state: string;
  by: string;
  comment: string;
  count: number;
}

/** The events of one cause. */
export interface Notice {
  cause: string;
  id: string;
  kind: string;
  kinds: string[];
  message: string;
  words: Words;
  first_s: number;
  last_s: number;
  count: number;
  seen: number;
  /** null: none of the events is an alarm */
  alarm: Alarm | null;
}

/** Rows of one parameter. */
export interface Trend {
  model: string;
  name: string;
  unit: string;
  time_s: number[];
  value: Sent[];
  sigma: Sent[];
  status: string[];
}

/** A message with the facts of an axis. */
export interface Beginning {
  facts: Facts;
  axes: string[];
  trends: Trend[];
}

/** A message; `newest` are the newest rows of the parameters. */
export type News = (Beginning | { facts?: undefined }) & {
  error?: string;
  words?: Words;
  span?: Span;
  health?: Health;
  notices?: Notice[];
  /** Causes that the server does not retain. */
  forgotten?: string[];
  history?: Transition[];
  verdicts?: AxisVerdict[];
  newest?: Trend[];
};

/** A request on the web socket; see queries.py. */
export type ClientRequest =
  | { kind: "watch"; axis: number; quantity: Quantity | null }
  | { kind: "freeze"; slot: number; time_s?: number; saved?: string }
  | { kind: "unfreeze"; slot: number }
  | { kind: "pause" | "resume" };

/** Values of one curve at the line under the cursor. */
export interface AtCursor {
  db: number;
  deg: number;
  reach: number;
  /** reach of noise, distortion and time variation, each alone */
  parts: number[];
  coherence: number;
  /** null where the curve is computed from others */
  frame: Frame | null;
}

/** A text at a frequency, saved with the run. */
export interface Annotation {
  id: string;
  text: string;
  frequency_hz: number;
}

export type Found = Partial<Record<Curves, AtCursor>>;

/** What is saved with the run; see records/saved_curves.py. */
export interface SavedCurves {
  references: { id: string; name: string; saved: string; time_s: number }[];
  annotations: Annotation[];
}

/** What an addition computes from the measured curve: the curve `what if`, and its margins. */
export interface Derived {
  /** null: there is none */
  curve(measured: Curve): Curve | null;
  marks(): Mark[];
  /** The margins of the fitted model are not shown beside these. */
  readonly alone: boolean;
}

/** A part that a plug-in adds to the page. */
export interface AddedPart {
  /** Another axis or run is shown, or other lines. */
  begin(): void;
  /** Once a frame, while `page.dirty` has "additions". */
  draw(): void;
  /** Another time is shown. */
  moment?(): void;
}

/** Called once, when the page is complete. */
export type Addition = (
  page: Page,
  bode: Bode,
  actions: {
    timeline: Timeline;
    watch: (quantity: Quantity) => void;
    /** Show another axis. */
    choose: (axis: number) => void;
    complain: (text: string) => void;
  },
) => AddedPart;

/** A part of the page that is drawn again when something of it has changed. */
export type Part = "bode" | "fits" | "additions" | "read" | "rows" | "map" | "trends";

/** What the page shows, and what is to be drawn again (`dirty`). */
export interface Page {
  axis: number;
  quantity: Quantity | null;
  spanS: string;
  tab: string;
  up: boolean;
  facts: Facts | null;
  health: Health | null;
  verdicts: AxisVerdict[];
  schedule: Named;
  rows: Rows;
  /** Part of the record that the tracking plot and the map show instead of `rows`. */
  past: { frame: Frame; from: number; to: number } | null;
  /** Span of time that was chosen in the tracking plot. */
  zoom: [fromS: number, toS: number] | null;
  /** Rows and span of time of the last drawing of the tracking plot. */
  seen: [rows: History, fromS: number, toS: number] | null;
  /** Frequency in Hz of the line under the cursor, and the values there. */
  read: [hz: number, found: Found] | null;
  dirty: Set<Part>;
  /** Time in ms of the last drawing of each part. */
  last: Partial<Record<Part, number>>;
  /** Identifies axis, lines and quantity of what is shown. */
  key: string | null;
  /** Identifies lines and quantity of the run. */
  measured: string | null;
  /** Axis that was chosen last; answers for others are ignored. */
  wanted?: number;
  /** The newest request for the past. */
  asked?: string;
  seeking: boolean;
  /** Whether the references of the address were requested. */
  restored?: boolean;
  /** Time to show after the one that is being fetched. */
  next?: number;
  silence?: number;
}

/** Called once, with a place above the list of runs; the answer is called whenever the list or the choice changes. */
export type Workspace = (place: HTMLElement) => (list: {
  directory: string;
  /** "operator" may change something; "viewer". */
  role: string;
  runs: ReadonlyMap<string, import("./runs_feed.js").RunRow>;
  chosen: ReadonlySet<string>;
}) => void;

declare global {
  interface Window {
    /** The parts of the page, for tests and for a person at the console of the browser. */
    livebode: object;
  }
}
