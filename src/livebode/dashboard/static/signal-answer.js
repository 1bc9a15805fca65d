// @ts-check
// Raw signals or their spectrum from the server; signal_answer.py documents the layout.

/**
 * A channel over time: sample numbers from the first one, and values. NaN is a missing sample.
 *
 * @typedef {object} Remarked
 * @property {string} name
 * @property {string} unit
 * @property {string} source_unit
 * @property {number} factor SI units in one unit of the source
 * @property {number} missing samples
 * @property {boolean} constant
 * @property {number | null} limit value at which it is cut off
 * @property {number} limited samples there
 * @property {number} points
 */
/** @typedef {Remarked & {at: Uint32Array, value: Float32Array}} Signal */
/**
 * Its spectrum: largest and smallest amplitude of each column of the plot, and amplitudes at the lines of the run.
 *
 * @typedef {Remarked & {hz: Float32Array, high: Float32Array, low: Float32Array, seconds: number,
 *   resolution_hz: number | null, lines: number[], detection: number[]}} Spectrum
 */
/**
 * @typedef {object} Head
 * @property {"" | "collecting" | "spectra" | "unrecorded" | "outside"} why_not
 * @property {number} rate_hz
 * @property {number} from_s
 * @property {number} to_s
 * @property {number} samples
 * @property {number[]} lines_hz
 * @property {number[]} detection_hz
 */
/** @typedef {Head & {channels: (Signal & Spectrum)[]}} Answer Either the arrays over time or those of a spectrum. */

/**
 * @param {ArrayBuffer} buffer
 * @param {boolean} spectrum
 * @returns {Answer}
 */
export function answerOf(buffer, spectrum) {
  const size = new DataView(buffer).getUint32(0, true),
    head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, size)));
  let next = 4 + size;
  /** @param {typeof Float32Array | typeof Uint32Array} kind @param {number} points */
  const taken = (kind, points) => {
    const found = new kind(buffer, next, points);
    next += 4 * points;
    return found;
  };
  for (const channel of head.channels ?? [])
    for (const name of spectrum ? ["hz", "high", "low"] : ["at", "value"])
      channel[name] = taken(name === "at" ? Uint32Array : Float32Array, channel.points);
  return head;
}

/**
 * A channel in the units of its source.
 *
 * @param {Signal & Spectrum} channel
 * @returns {Signal & Spectrum}
 */
export function inSourceUnits(channel) {
  const { factor, limit, source_unit: unit } = channel;
  /** @template {Float32Array | number[] | undefined} V @param {V} values @returns {V} */
  const scaled = (values) => /** @type {V} */ (values?.map((v) => v / factor));
  const { value, high, low, lines, detection } = channel;
  return {
    ...channel,
    unit,
    limit: limit === null ? null : limit / factor,
    value: scaled(value),
    high: scaled(high),
    low: scaled(low),
    lines: scaled(lines),
    detection: scaled(detection),
  };
}
