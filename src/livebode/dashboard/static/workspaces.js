// @ts-check
// Parts that plug-ins add to the list of runs, by name: the server answers with those that are installed.

/** @import { Workspace } from "./messages.js" */

/** @type {Record<string, Workspace>} */
export const WORKSPACES = {};
