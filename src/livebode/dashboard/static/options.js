// @ts-check
// A choice between a few buttons that is in the address; what is not possible is absent.
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
   */
  constructor(host, name, choices, act) {
    this.host = host;
    this.name = name;
    this.choices = choices;
    this.act = act;
    const values = choices.map(([value]) => value);
    this.first = values[0];
    this.wanted = chosen(name, this.first, values);
    /** @type {V} what is shown, which differs from what is wanted while that is not possible */
    this.value = this.first;
    /** @type {Set<V>} what is not possible */
    this.absent = new Set();
    this.follow();
  }

  /** @param {V} value */
  choose(value) {
    this.wanted = value;
    if (this.entry) enter();
    remember(this.name, value, this.first);
    this.follow();
  }

  /** @param {V} value @param {boolean} possible */
  permit(value, possible) {
    if (this.absent.has(value) !== possible) return;
    if (possible) this.absent.delete(value);
    else this.absent.add(value);
    this.follow();
  }

  follow() {
    const possible = this.choices.filter(([choice]) => !this.absent.has(choice)),
      value = this.absent.has(this.wanted) ? (possible[0]?.[0] ?? this.first) : this.wanted;
    segments(
      this.host,
      possible.length > 1 ? possible.map(([choice, text]) => ({ value: choice, text })) : [],
      value,
      (choice) => this.choose(choice),
    );
    if (value === this.value) return;
    this.value = value;
    this.act(value);
  }
}
