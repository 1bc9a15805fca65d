// @ts-check
// Parts that plug-ins add to the page of a run, by name: the server answers with those that are installed.

/** @import { Addition } from "./messages.js" */

/** @type {Record<string, Addition>} */
export const ADDITIONS = {};
