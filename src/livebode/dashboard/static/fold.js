// @ts-check
// On a telephone the plots come first: a button shows the controls that it stands for, and hides them again.

export function folds() {
  for (const button of document.querySelectorAll("button.fold"))
    button.addEventListener("click", () => {
      const open = button.getAttribute("aria-expanded") !== "true";
      button.setAttribute("aria-expanded", String(open));
    });
}
