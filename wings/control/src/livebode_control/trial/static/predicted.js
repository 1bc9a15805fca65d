// @ts-check
// The margins of a loop from its measured plant, as measured and of the worst plant within its bounds: the definitions of
// livebode_control.tuning.predicted and livebode.margins.stability, so that the numbers are those of `livebode tune`.

/** @import { Numbers } from "./curves.js" */
/** A curve of L with the radius that contains it, at the frequencies of the band, and the rise above the lines. @typedef {{re: Float64Array, im: Float64Array, radius: Float64Array, rise: Numbers}} Disc */
/** Infinite where nothing limits it. @typedef {{bandwidthHz: number, gainMarginDb: number, phaseMarginDeg: number, ms: number, disk: number}} Predicted */

const EDGES = 24;
const COS = Float64Array.from({ length: EDGES }, (_, k) => Math.cos((2 * Math.PI * k) / EDGES));
const SIN = Float64Array.from({ length: EDGES }, (_, k) => Math.sin((2 * Math.PI * k) / EDGES));
/** `Math.hypot` is several times slower. @param {number} x @param {number} y */
const length = (x, y) => Math.sqrt(x * x + y * y);
const DEG = 180 / Math.PI;
const HALF_POWER_DB = 20 * Math.log10(Math.SQRT2);

/**
 * Over all places, each the worst.
 *
 * @param {Numbers} hz
 * @param {Disc[]} places
 * @param {number} known how many frequencies are within the lines: above, nothing is measured
 * @param {boolean} worst of the worst plant within the radius
 * @returns {Predicted}
 */
export function predicted(hz, places, known, worst) {
  const found = places.map((place) => {
    const radius = worst ? place.radius : new Float64Array(place.radius.length),
      [re, im] = [place.re, place.im].map((all) => all.subarray(0, known)),
      disc = { re, im, radius: radius.subarray(0, known), rise: [] };
    return {
      bandwidthHz: bandwidth(hz, disc),
      gainMarginDb: gainMargin(disc),
      phaseMarginDeg: phaseMargin(disc),
      ms: sensitivity(disc),
      disk: diskMargin(disc),
    };
  });
  /** @param {(...values: number[]) => number} best @param {keyof Predicted} name */
  const of = (best, name) => best(...found.map((one) => one[name]));
  return {
    bandwidthHz: of(Math.min, "bandwidthHz"),
    gainMarginDb: of(Math.min, "gainMarginDb"),
    phaseMarginDeg: of(Math.min, "phaseMarginDeg"),
    ms: of(Math.max, "ms"),
    disk: of(Math.min, "disk"),
  };
}

/** Ms: the largest 1/(|1 + L| − r). @param {Disc} disc */
function sensitivity({ re, im, radius }) {
  let least = Infinity;
  for (let i = 0; i < re.length; i++) least = Math.min(least, length(1 + re[i], im[i]) - radius[i]);
  return 1 / Math.max(least, 1e-12);
}

/** α = min 2·|1 + L|/|1 − L| on the edges of the discs. @param {Disc} disc */
function diskMargin({ re, im, radius }) {
  let least = Infinity;
  for (let i = 0; i < re.length; i++) {
    const edges = radius[i] === 0 ? 1 : EDGES;
    for (let k = 0; k < edges; k++) {
      const x = re[i] + radius[i] * COS[k],
        y = (im[i] + radius[i] * SIN[k]) ** 2,
        square = ((1 + x) ** 2 + y) / ((1 - x) ** 2 + y);
      if (square < least) least = square;
    }
  }
  return 2 * Math.sqrt(least);
}

/** From the point of the negative real axis nearest to −1, on the side of 0, that a disc or the curve reaches. @param {Disc} disc */
function gainMargin({ re, im, radius }) {
  let lowest = 0;
  const see = (/** @type {number} */ at) => {
    if (at > -1 && at < lowest) lowest = at;
  };
  for (let i = 0; i < re.length; i++) {
    const reach = radius[i] ** 2 - im[i] ** 2;
    if (reach >= 0 && re[i] < 0) see(re[i] - Math.sqrt(reach));
    if (i + 1 === re.length || im[i] * im[i + 1] >= 0 || Math.min(re[i], re[i + 1]) >= 0) continue;
    const share = im[i] / (im[i] - im[i + 1]);
    see(re[i] + share * (re[i + 1] - re[i]) - (radius[i] * (1 - share) + radius[i + 1] * share));
  }
  return lowest < 0 ? -20 * Math.log10(-lowest) : Infinity;
}

/** From the points of the unit circle that a disc or the curve reaches. @param {Disc} disc */
function phaseMargin({ re, im, radius }) {
  let least = Infinity;
  const size = re.map((v, i) => length(v, im[i]));
  for (let i = 0; i < re.length; i++) {
    const [a, r] = [size[i], radius[i]];
    if (a > 0 && Math.abs(a - 1) <= r) {
      const half = Math.acos(Math.min(1, Math.max(-1, (1 + a ** 2 - r ** 2) / (2 * a))));
      least = Math.min(least, Math.abs(Math.atan2(-im[i], -re[i])) - half);
    }
    if (i + 1 === re.length || (a - 1) * (size[i + 1] - 1) >= 0) continue;
    const share = (a - 1) / (a - size[i + 1]),
      turn = Math.atan2(im[i + 1] * re[i] - re[i + 1] * im[i], re[i + 1] * re[i] + im[i + 1] * im[i]),
      angle = Math.atan2(-im[i], -re[i]) + share * turn,
      wide = Math.asin(Math.min(1, Math.max(0, r * (1 - share) + radius[i + 1] * share)));
    least = Math.min(least, Math.abs(angle - 2 * Math.PI * Math.round(angle / (2 * Math.PI))) - wide);
  }
  return least * DEG;
}

/** Where the least |T| within the discs first falls 3 dB below one, interpolated in the logarithms. @param {Numbers} hz @param {Disc} disc */
function bandwidth(hz, disc) {
  let before = NaN;
  for (let i = 0; i < disc.re.length; i++) {
    const level = 20 * Math.log10(Math.max(leastClosed(disc, i), 1e-300)) + HALF_POWER_DB;
    if (level < 0) return i ? hz[i - 1] * (hz[i] / hz[i - 1]) ** (before / (before - level)) : hz[0];
    before = level;
  }
  return Infinity;
}

/** The least |T| within a disc: 1/|T| = |1 + 1/L| is largest, and 1/L is in a disc, too. @param {Disc} disc @param {number} i */
function leastClosed({ re, im, radius }, i) {
  const square = re[i] ** 2 + im[i] ** 2,
    r = radius[i];
  if (square <= r ** 2) return 0;
  const below = square - r ** 2;
  return 1 / (length(1 + re[i] / below, -im[i] / below) + r / below);
}

/**
 * Nyquist's criterion for a sampled loop whose open loop has no unstable poles: along the upper half of the unit circle, and
 * around its ν integrators, the angle of 1 + L turns from −ν·π/2 to 0.
 *
 * @param {Numbers} hz ascending, the last half the rate
 * @param {{re: Numbers, im: Numbers}} loop
 */
export function stable(hz, { re, im }) {
  const size = [0, 1].map((i) => Math.log(length(re[i], im[i])));
  const integrators = Math.round(-(size[1] - size[0]) / Math.log(hz[1] / hz[0]));
  let angle = Math.atan2(im[0], 1 + re[0]);
  const turns = Math.round((angle + (integrators * Math.PI) / 2) / (2 * Math.PI));
  for (let i = 1; i < re.length; i++) {
    const next = Math.atan2(im[i], 1 + re[i]);
    angle = next - 2 * Math.PI * Math.round((next - angle) / (2 * Math.PI));
  }
  return Math.abs(angle - 2 * Math.PI * turns) < Math.PI / 2;
}

/** Whether no plant within the bounds is unstable, if the measured one is stable. @param {Disc[]} places @param {number} known */
export const keepsClear = (places, known) =>
  places.every(({ re, im, radius }) => re.subarray(0, known).every((v, i) => length(1 + v, im[i]) > radius[i]));

/**
 * Where the bound comes nearest to −1, or past it: its place, its index and its share of |L|.
 *
 * @param {Disc[]} places
 * @param {number} known
 */
export function widest(places, known) {
  let [place, at, most] = [0, 0, -Infinity];
  for (const [n, { re, im, radius }] of places.entries())
    for (let i = 0; i < known; i++) {
      const reach = radius[i] / length(1 + re[i], im[i]);
      if (reach > most) [place, at, most] = [n, i, reach];
    }
  const { re, im, radius } = places[place];
  return { place, at, share: radius[at] / length(re[at], im[at]) };
}

/** The largest |L| of every resonance that the lines permit above them, where no phase is known. @param {Disc[]} places @param {number} known */
export const largestAbove = (places, known) =>
  Math.max(0, ...places.flatMap(({ rise, ...loop }) => fall(loop, known).map((size, i) => size * rise[i])));

/** The largest |L| above the lines if there is no resonance. @param {Disc[]} places @param {number} known */
export const largestFall = (places, known) => Math.max(0, ...places.flatMap((loop) => fall(loop, known)));

/** @param {{re: Float64Array, im: Float64Array}} loop @param {number} known */
const fall = ({ re, im }, known) => Array.from(re.subarray(known), (v, i) => length(v, im[known + i]));

/** The same if |L| is up to `largest`, below 1, with any phase at other frequencies. @param {Predicted} found @param {number} largest @returns {Predicted} */
export const withUnknown = (found, largest) => ({
  ...found,
  gainMarginDb: Math.min(found.gainMarginDb, -20 * Math.log10(largest)),
  ms: Math.max(found.ms, 1 / (1 - largest)),
  disk: Math.min(found.disk, (2 * (1 - largest)) / (1 + largest)),
});

/** The frequency at which L is nearest to −1. @param {Numbers} hz @param {Disc[]} places @param {number} known */
export function nearestHz(hz, places, known) {
  let [best, least] = [hz[0], Infinity];
  for (const { re, im } of places)
    for (let i = 0; i < known; i++) {
      const away = length(1 + re[i], im[i]);
      if (away < least) [best, least] = [hz[i], away];
    }
  return best;
}
