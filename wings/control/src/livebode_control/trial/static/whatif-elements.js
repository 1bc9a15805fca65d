// @ts-check
// The elements of "What if": the button, the line above the plot and the card.
import { tr } from "./language.js";
import { byId as $, element } from "./make.js";

/** @param {string} id @param {string} words @param {string} title */
const button = (id, words, title) => element("button", { id, type: "button", title }, words);

/** Add the elements to the page; the card is beside the plot. */
export function attach() {
  const open = button("what-if", tr("What if"), tr("Try other gains and filters"));
  open.setAttribute("aria-expanded", "false");
  open.setAttribute("aria-controls", "what-if-card");
  $("bode-actions").append(open);
  $("magnitude").before(element("p", { class: "brief", id: "what-if-brief", hidden: true }));
  $("magnitude").parentElement?.after(card());
}

function card() {
  const close = tr("Close");
  const header = element(
    "header",
    {},
    element("h2", { id: "what-if-title" }, tr("What if")),
    element(
      "div",
      { class: "actions" },
      button("what-if-toml", tr("Copy as TOML"), tr("Copy gains and filters as text for the configuration")),
      button("what-if-biquads", tr("Copy biquads"), tr("Copy the filters as coefficients (JSON)")),
      button("what-if-reset", tr("Reset"), tr("Back to the described loop")),
      element(
        "button",
        { id: "what-if-close", type: "button", class: "icon", "aria-label": close, title: tr("Close (Esc)") },
        "×",
      ),
    ),
  );
  const plant = element(
    "p",
    { class: "note", id: "what-if-plant", hidden: true },
    tr("The plant does not contain the controllers."),
    " ",
    element("button", { id: "what-if-open-loop", type: "button" }, tr("Show the open loop")),
  );
  const rows = { class: "sliders", id: "what-if-rows", role: "group", "aria-label": tr("Gains and filters") };
  const text = { id: "what-if-text", rows: 8, readonly: true, hidden: true, "aria-label": tr("Values to copy") };
  const title = "what-if-title";
  return element(
    "section",
    { class: "card what-if", id: "what-if-card", "aria-labelledby": title, hidden: true },
    header,
    element(
      "div",
      { class: "tried scroll", tabindex: 0, role: "group", "aria-labelledby": title },
      element("p", { class: "check open", id: "what-if-check" }, tr("Reading the response of the run …")),
      element("div", rows),
      element("textarea", text),
      plant,
      element("div", { id: "what-if-margins" }),
      element("div", { id: "what-if-steps" }),
      element(
        "p",
        { class: "note" },
        tr("A calculation in this page: nothing is written to a machine, and it is not recorded."),
      ),
    ),
  );
}
