// The frozen reference: this moment's response, kept beside what follows.
export const REFERENCE_GONE =
  "A new run has begun with other lines or another quantity: the frozen reference was let go.";

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
