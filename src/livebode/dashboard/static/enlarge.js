// @ts-check
// The card of map, parameters, margins and signals over the whole page.
import { chosen, remember } from "./address.js";

/**
 * @param {HTMLElement} button
 * @returns {() => void} enlarges or reduces the card
 */
export function enlarging(button) {
  let large = chosen("large", String()) === "1";
  const show = () => {
    button.closest(".grid")?.classList.toggle("large", large);
    button.setAttribute("aria-pressed", String(large));
  };
  const toggle = () => {
    large = !large;
    remember("large", large ? "1" : "", "");
    show();
  };
  button.addEventListener("click", toggle);
  show();
  return toggle;
}
