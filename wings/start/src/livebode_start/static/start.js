// @ts-check
// What the list of runs has above it: how to make one.

/** @import { Workspace } from "./messages.js" */

/** @type {Workspace} */
export const workspace = (_place) => (_list) => {};
