// @ts-check
// The way back to the list, where this is the page of one run of many.
import { byId } from "./make.js";

byId("back").hidden = !location.pathname.startsWith("/run/");
