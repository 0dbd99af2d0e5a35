// Numbers that people type: read, or marked with a sentence; none is changed without a word.
import { t } from "./texts.js";

const NUMBER = /^[+-]?(\d+([.,]\d*)?|[.,]\d+)(e[+-]?\d+)?$/i;
const WIDEST = 7; // characters that a field shows

/** The number in a text, whose decimal sign is a point or a comma; NaN if there is none. */
export function parse(text) {
  const plain = text.trim().replaceAll("−", "-");
  const value = NUMBER.test(plain) ? Number(plain.replace(",", ".")) : NaN;
  return Number.isFinite(value) ? value : NaN;
}

/** A number as text: with so many decimals, or more where it has more. */
export function shown(value, digits) {
  const exact = +value.toPrecision(12);
  const rounded = exact.toFixed(digits);
  return Number(rounded) === exact ? rounded : String(exact);
}

/** What is wrong with a number that must lie within these limits, null for none; "" if nothing is. */
function outside(value, text, { least = null, most = null, name, unit = "" }) {
  if (Number.isNaN(value)) return t("no_number", { text });
  if ((least === null || value >= least) && (most === null || value <= most)) return "";
  const key = most === null ? "number_least" : least === null ? "number_most" : "number_range";
  return t(key, { name, least, most, unit, text }).replace(/ +([,.;])/g, "$1");
}

let notes = 0;

/** A text field for a number. */
export class NumberField {
  /**
   * `about`: name, unit, least, most (null: no limit), step of the arrow keys, and whether it may be empty.
   * `changed` is given the number where it can be used.
   */
  constructor(input, about, changed = () => {}) {
    this.input = input;
    this.about = about;
    this.changed = changed;
    Object.assign(input, { type: "text", inputMode: "decimal", autocomplete: "off" });
    input.classList.add("number");
    // Taken back while it is typed: the page must not move under a click that ends the typing.
    input.addEventListener("input", () => this.note && !this.wrong && this.mark(""));
    input.addEventListener("change", () => {
      const value = this.value;
      if (value !== undefined && value !== null) this.changed(value);
    });
    if (about.step) input.addEventListener("keydown", (e) => this.step(e));
  }

  /** The number; null for an empty field that may be empty; undefined, and the field marked, if it cannot be used. */
  get value() {
    const { wrong } = this;
    this.mark(wrong);
    if (wrong) return undefined;
    const { value } = this.input;
    return value === this.rounded?.text ? this.rounded.value : value.trim() ? parse(value) : null;
  }

  /** What is wrong with what stands there; "" if nothing is. */
  get wrong() {
    const text = this.input.value.trim();
    return !text && this.about.optional ? "" : outside(parse(text), text, this.about);
  }

  /** Show a number's text; one with too many digits for the field is rounded, and in full in the tooltip. */
  show(text) {
    const value = parse(text);
    const brief = text.length > WIDEST && !Number.isNaN(value) ? String(+value.toPrecision(5)) : text;
    this.rounded = brief === text ? null : { text: brief, value };
    this.input.value = brief;
    this.input.title = this.rounded ? text : "";
    this.mark("");
  }

  step(e) {
    const by = { ArrowUp: 1, ArrowDown: -1 }[e.key];
    const value = this.input.value === this.rounded?.text ? this.rounded.value : parse(this.input.value);
    if (!by || Number.isNaN(value)) return;
    e.preventDefault();
    this.input.value = String(+(value + by * this.about.step).toPrecision(12));
    this.input.dispatchEvent(new Event("change"));
  }

  /** Say what is wrong under the field; "" takes it back. */
  mark(wrong) {
    this.note?.remove();
    this.note = null;
    this.input.removeAttribute("aria-describedby");
    this.input.toggleAttribute("aria-invalid", false);
    if (!wrong) return;
    this.note = document.createElement("p");
    this.note.className = "wrong";
    this.note.id = `wrong-${(notes += 1)}`;
    this.note.setAttribute("role", "alert");
    this.note.textContent = wrong;
    (this.input.closest(".row") ?? this.input.closest("label") ?? this.input).after(this.note);
    this.input.setAttribute("aria-invalid", "true");
    this.input.setAttribute("aria-describedby", this.note.id);
  }
}
