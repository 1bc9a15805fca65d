// Types of what the server answers about the loop (loop_trials.py, trial_steps.py).
import type { Words } from "./messages.js";

/** A curve times a parameter to a power; without a name the curve alone. See tuning/feedback_parts.py. */
export interface LoopTerm {
  name: string;
  power: number;
  re: number[];
  im: number[];
}

/** F = gain·(sum of the terms)·(1 + outer). */
export interface LoopParts {
  terms: LoopTerm[];
  outer: LoopTerm | null;
}

/** The plant on a grid of frequencies with the radius that contains it; `known` of them are not above the lines. */
export interface LoopBand {
  frequency_hz: number[];
  known: number;
  lines_hz: number[];
  dropped: number;
  confidence: number;
  /** `rise`: above the lines, the factor by which a resonance that they permit exceeds the fall. */
  places: { re: number[]; im: number[]; radius: number[]; rise: number[] }[];
  parts: LoopParts;
}

/** What a trial of other gains and filters needs; see loop_trials.py. */
export interface LoopFacts {
  described: boolean;
  /** of `livebode validate --loop` */
  verdict: "as described" | "one change" | "not explained" | "not checked";
  sentence: string;
  /** Key of each parameter in the configuration. */
  tables: Record<string, string>;
  values: Record<string, number>;
  rate_hz: number;
  /** Grid of the page. */
  frequency_hz: number[];
  parts: LoopParts;
  band: LoopBand | null;
  band_why_not: Words;
  /** Of `livebode tune`; without gains where the run has only its filters. */
  proposed: {
    gains: Record<string, number> | null;
    notches: { hz: number; depth_db: number; damping: number }[];
    low_passes_hz: number[];
  } | null;
}

export type LoopAnswer = (LoopFacts & { why_not: "" }) | { why_not: Words; described?: undefined };

/** A step with its band; without one where a plant within the bounds may be unstable. */
export interface StepBand {
  value: number[];
  low: number[] | null;
  high: number[] | null;
}

/** Rms of the plant input for white noise of 1 at the output, and its range over all plants within the bounds. */
export interface NoiseRange {
  value: number;
  low: number | null;
  high: number | null;
}

/** Without disturbance and noise where the run measured L and its loop is not described. */
export interface StepsSide {
  reference: StepBand;
  disturbance: StepBand | null;
  noise: NoiseRange | null;
}

/** Predicted steps of a trial; see trial_steps.py. A side that is null is unstable. */
export interface StepsAnswer {
  time_ms: number[];
  before: StepsSide | null;
  after: StepsSide | null;
  /** Of the plant. */
  unit: string;
  places: number;
}
