// @ts-check
// The page of an error has the colours that this browser has chosen.
import { applyTheme } from "./theme.js";

applyTheme();
