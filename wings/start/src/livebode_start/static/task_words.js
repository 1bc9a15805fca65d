// @ts-check
// What the tasks and their fields are called; the rest of a field is in the words of the help of its command.
import { tr } from "./language.js";

/**
 * @typedef {object} TaskWords
 * @property {string} title
 * @property {string} about
 * @property {string} start on the button
 * @property {string} doing
 */

/** @type {Record<string, TaskWords>} */
export const TASKS = {
  compare: {
    title: tr("Comparison as HTML and PDF"),
    about: tr("What differs between two runs of a machine, with bounds, as a report."),
    start: tr("Compare"),
    doing: tr("Comparing …"),
  },
  learn: {
    title: tr("Learn a baseline"),
    about: tr("From runs of the healthy machine. Later runs are compared with it, and a change is an alarm."),
    start: tr("Learn"),
    doing: tr("Learning …"),
  },
  report: {
    title: tr("Write a report"),
    about: tr(
      "The measurement and its results for a customer, with a verdict on the limits. Empty fields are left out.",
    ),
    start: tr("Write"),
    doing: tr("Writing …"),
  },
  design: {
    title: tr("Design an excitation"),
    about: tr(
      "Lines, amplitude and duration for a machine within its limits, with the reasons, and the files to play it.",
    ),
    start: tr("Design"),
    doing: tr("Designing …"),
  },
};

/** Label and unit of each field. @type {Record<string, [label: string, unit?: string]>} */
const LABELS = {
  "--ignore-below": [tr("Ignore changes below"), tr("dB or %")],
  "--machine": [tr("Machine")],
  "--serial-number": [tr("Serial number")],
  "--operator": [tr("Operator")],
  "--company": [tr("Company")],
  "--customer": [tr("Customer")],
  "--conditions": [tr("Conditions")],
  "--paper": [tr("Paper")],
  "--appendix": [tr("Configuration and versions as an appendix")],
  "--reason": [tr("Reason")],
  "--band": [tr("Band"), "Hz : Hz"],
  "--resolution": [tr("Distance of the lines"), "Hz"],
  "--lines": [tr("Lines instead of a band"), "Hz"],
  "--amplitude": [tr("Amplitude of each line"), "N m"],
  "--accuracy": [tr("Required 95 % bound, as a share of |G|")],
  "--seed": [tr("Random seed")],
  "limits.torque_n_m_max": [tr("Largest torque"), "N m"],
  "limits.speed_m_per_s_max": [tr("Largest speed"), "m/s"],
  "limits.following_error_m_max": [tr("Largest following error"), "m"],
  "limits.position_m_min": [tr("Lower end of the travel"), "m"],
  "limits.position_m_max": [tr("Upper end of the travel"), "m"],
  "measured.output": [tr("Output of the run")],
  "measured.radius_m": [tr("Travel per radian"), "m"],
  "measured.noise": [tr("Noise of the output")],
  "measured.torque_n_m": [tr("Torque in the motion alone"), "N m : N m"],
  "measured.speed_m_per_s": [tr("Speed in the motion alone"), "m/s : m/s"],
  "measured.position_m": [tr("Position in the motion alone"), "m : m"],
  "measured.following_error_m": [tr("Following error in the motion alone"), "m : m"],
  "loop.velocity.gain": [tr("Gain of the velocity controller"), "N m s"],
  "loop.velocity.integral_time_s": [tr("Integral time"), "s"],
  "loop.velocity.rate_hz": [tr("Rate of the velocity controller"), "Hz"],
  "loop.position.gain": [tr("Gain of the position controller"), "1/s"],
  "loop.position.rate_hz": [tr("Rate of the position controller"), "Hz"],
  "belt.mechanics.inertia_kg_m2": [tr("Inertia of motor and pulleys"), "kg m²"],
  "belt.mechanics.load_kg": [tr("Mass of the cart"), "kg"],
  "belt.mechanics.radius_m": [tr("Radius of the pulleys"), "m"],
  "belt.mechanics.stiffness_n_per_m": [tr("Stiffness of the belt"), "N/m"],
  "belt.drive.rate_hz": [tr("Rate of the drive"), "Hz"],
  "belt.drive.torque_n_m_max": [tr("Torque limit of the drive"), "N m"],
  "belt.drive.velocity_gain_n_m_s": [tr("Gain of the velocity controller"), "N m s"],
  "belt.drive.integral_time_s": [tr("Integral time"), "s"],
  "belt.drive.position_gain_per_s": [tr("Gain of the position controller"), "1/s"],
  "belt.sensor.noise_rad_per_s": [tr("Noise of the velocity"), "rad/s"],
  "report.limits.quantity": [tr("Quantity")],
  "report.limits.min": [tr("Smallest")],
  "report.limits.max": [tr("Largest")],
  "report.limits.band_hz": [tr("Band"), "Hz : Hz"],
};

/** @param {string} name */
export const label = (name) => LABELS[name]?.[0] ?? name.replace(/^--/, "").replaceAll("-", " ");
/** @param {string} name */
export const unit = (name) => LABELS[name]?.[1] ?? "";

/** Titles of the groups of fields, by the beginning of their names. @type {[begin: string, title: string][]} */
export const GROUPS = [
  ["limits.", tr("Limits of the machine")],
  ["measured.", tr("Motion and sensor of the measured machine")],
  ["loop.", tr("Controllers, where the run does not describe them")],
  ["belt.", tr("Tooth-belt axis by its constants")],
];
