// @ts-check
// A choice between a few buttons that is in the address; one of them can be disabled with the reason.
import { chosen, enter, remember } from "./address.js";
import { segments } from "./make.js";

/** @template {string} V */
export class Option {
  /** Whether each choice is an entry of the history. */
  entry = false;

  /**
   * @param {HTMLElement} host
   * @param {string} name in the address
   * @param {[value: V, text: string][]} choices the first is the default
   * @param {(value: V) => void} act called with each other choice, also with the one of the address
   * @param {(text: string) => void} complain
   */
  constructor(host, name, choices, act, complain) {
    this.host = host;
    this.name = name;
    this.choices = choices;
    this.act = act;
    this.complain = complain;
    const values = choices.map(([value]) => value);
    this.first = values[0];
    this.wanted = chosen(name, this.first, values);
    /** @type {V} what is shown, which differs from what is wanted while that is disabled */
    this.value = this.first;
    /** @type {Map<V, string>} */
    this.why = new Map();
    this.follow();
  }

  /** @param {V} value */
  choose(value) {
    this.wanted = value;
    if (this.entry) enter();
    remember(this.name, value, this.first);
    this.follow();
  }

  /**
   * Disable a choice with the reason, or enable it with none.
   *
   * @param {V} value
   * @param {string} why
   */
  disable(value, why) {
    if ((this.why.get(value) ?? "") === why) return;
    this.why.set(value, why);
    this.follow();
  }

  follow() {
    const possible = this.choices.find(([choice]) => !this.why.get(choice))?.[0] ?? this.first;
    const value = this.why.get(this.wanted) ? possible : this.wanted;
    segments(
      this.host,
      this.choices.map(([choice, text]) => ({ value: choice, text, why: this.why.get(choice) })),
      value,
      (choice, why) => (why ? this.complain(why) : this.choose(choice)),
    );
    if (value === this.value) return;
    this.value = value;
    this.act(value);
  }
}
