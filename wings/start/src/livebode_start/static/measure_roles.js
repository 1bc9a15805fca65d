// @ts-check
// The role of each channel: a select for each role, on which a channel can be dropped too.
import { tr } from "./language.js";
import { element } from "./make.js";
import { worded } from "./worded.js";

/** @typedef {"excitation" | "input" | "output" | "schedule"} Role */
/** @typedef {{channel: string | null, reason: import("./messages.js").Words, others: string[]}} Guess */
/** @typedef {{name: string, unit: string, kind: string, constant: boolean, not_finite: number}} Channel */

/** @type {Role[]} */
export const ROLES = ["excitation", "input", "output", "schedule"];
export const CHANNEL_TYPE = "application/x-livebode-channel";

/** @param {Role} role */
export const roleName = (role) =>
  ({
    excitation: tr("Excitation"),
    input: tr("Input"),
    output: tr("Output"),
    schedule: tr("Schedule"),
  })[role];

/** @param {Role} role */
const meaning = (role) =>
  ({
    excitation: tr("the signal that was added"),
    input: tr("of the plant, such as the torque"),
    output: tr("of the plant, such as the velocity"),
    schedule: tr("what the response depends on, such as the position"),
  })[role];

export class Roles {
  /**
   * @param {HTMLElement} host
   * @param {Channel[]} channels
   * @param {Record<Role, Guess>} guesses
   * @param {() => void} onChange
   */
  constructor(host, channels, guesses, onChange) {
    this.guesses = guesses;
    this.onChange = onChange;
    /** @type {Partial<Record<Role, string>>} */
    this.chosen = {};
    /** @type {Map<Role, HTMLSelectElement>} */
    this.selects = new Map();
    /** @type {Map<Role, HTMLElement>} */
    this.reasons = new Map();
    host.replaceChildren(...ROLES.map((role) => this.slot(role, channels)));
    this.draw();
  }

  /**
   * @param {Role} role
   * @param {Channel[]} channels
   */
  slot(role, channels) {
    const id = `role-${role}`,
      select = element("select", { id, onchange: () => this.choose(role, select.value) }),
      reason = element("small", { id: `${id}-reason` });
    select.setAttribute("aria-describedby", reason.id);
    select.append(element("option", { value: "" }, tr("none")));
    for (const { name, unit } of channels)
      select.append(element("option", { value: name }, unit ? `${name} · ${unit}` : name));
    select.value = this.guesses[role].channel ?? "";
    this.selects.set(role, select);
    this.reasons.set(role, reason);
    const slot = element(
      "div",
      { class: "slot", "data-role": role },
      element("label", { for: id }, roleName(role), element("small", {}, meaning(role))),
      select,
      reason,
    );
    slot.addEventListener("dragover", (event) => {
      if (!event.dataTransfer?.types.includes(CHANNEL_TYPE)) return;
      event.preventDefault();
      slot.classList.add("over");
    });
    slot.addEventListener("dragleave", () => slot.classList.remove("over"));
    slot.addEventListener("drop", (event) => {
      event.preventDefault();
      slot.classList.remove("over");
      this.choose(role, event.dataTransfer?.getData(CHANNEL_TYPE) ?? "");
    });
    return slot;
  }

  /**
   * A channel has one role: the one that it had before gets the channel that was here.
   *
   * @param {Role} role
   * @param {string} name
   */
  choose(role, name) {
    const before = this.chosen[role] ?? "";
    for (const [other, select] of this.selects)
      if (other !== role && name && this.chosen[other] === name) select.value = before;
    const select = this.selects.get(role);
    if (select) select.value = name;
    this.draw();
    this.onChange();
  }

  draw() {
    this.chosen = {};
    for (const [role, select] of this.selects) {
      if (select.value) this.chosen[role] = select.value;
      const guess = this.guesses[role],
        reason = this.reasons.get(role),
        own = (guess.channel ?? "") === select.value;
      if (!reason) continue;
      reason.textContent = own ? [worded(guess.reason), ...alternatives(guess)].join("; ") : tr("as chosen");
      reason.classList.toggle("doubt", own && guess.others.length > 0);
    }
  }
}

/** @param {Guess} guess */
const alternatives = ({ others }) =>
  others.length ? [tr("{channels} also possible", { channels: others.join(tr(", ")) })] : [];
