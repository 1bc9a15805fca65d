// @ts-check
// Recorded sentences on the page: their times of day by the chosen clock, in the language of the page.
import { recordedTime } from "./clock.js";
import { recognised } from "./recognition.js";

/** @param {{message: string, times?: [text: string, unixS: number][]}} of `times` in the sentence */
export const dated = ({ message, times = [] }) =>
  recognised(times.reduce((text, [words, unixS]) => text.replace(words, recordedTime(unixS)), message));
