// The frozen reference: a response that remains in the plot.
export const REFERENCE_GONE =
  "A new run with other lines or another quantity has started: the frozen reference was released.";

export function freezing(page, { bode, link }, button, legend) {
  function freeze() {
    if (page.frozen) {
      letGo();
      return;
    }
    const timeS = bode.curves.measured?.frame.timeS[0];
    if (timeS === undefined) return;
    link.wish({ kind: "freeze", time_s: timeS }, "freeze");
    frozen(true);
  }

  function letGo() {
    link.forget("freeze");
    link.wish({ kind: "unfreeze" });
    bode.drop("reference");
    page.dirty.add("bode");
    frozen(false);
  }

  function frozen(is) {
    page.frozen = is;
    button.textContent = is ? "Unfreeze" : "Freeze";
    button.classList.toggle("primary", is);
    legend();
  }

  return { freeze, letGo };
}
