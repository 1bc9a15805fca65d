// @ts-check
// A panel below its button: opened and closed by the button, closed by Escape and by a click elsewhere.

/**
 * @param {HTMLElement} button
 * @param {HTMLElement} panel
 * @param {() => void} fill called before it is shown
 */
export function popover(button, panel, fill) {
  /** @param {boolean} open @param {boolean} back the focus returns to the button */
  const show = (open, back) => {
    if (panel.hidden === !open) return;
    if (open) fill();
    panel.hidden = !open;
    button.setAttribute("aria-expanded", String(open));
    if (!open) {
      if (back) button.focus();
      return;
    }
    const first = panel.querySelector("select, input, button");
    if (first instanceof HTMLElement) first.focus();
    // It must not leave a narrow window.
    panel.style.transform = "";
    const { left } = panel.getBoundingClientRect();
    if (left < 4) panel.style.transform = `translateX(${4 - left}px)`;
  };
  button.addEventListener("click", () => show(Boolean(panel.hidden), true));
  document.addEventListener("pointerdown", ({ target }) => {
    if (!(target instanceof Node && button.parentElement?.contains(target))) show(false, false);
  });
  document.addEventListener("keydown", ({ key }) => {
    if (key === "Escape") show(false, panel.contains(document.activeElement));
  });
  return show;
}
