// A tour of six steps, each with an aim and a question; the page stays usable meanwhile.
import { list, t } from "./texts.js";

const $ = (id) => document.getElementById(id);

export class Tour {
  /** `steps`: what the page does at each step. */
  constructor(steps) {
    this.steps = steps;
    this.words = list("tour_steps");
    $("tour-begin").addEventListener("click", () => this.go(0));
    $("tour-next").addEventListener("click", () => this.go(this.at + 1));
    $("tour-back").addEventListener("click", () => this.go(this.at - 1));
    $("tour-end").addEventListener("click", () => this.end());
  }

  go(at) {
    if (at >= this.steps.length) return this.end();
    this.at = Math.max(0, at);
    const [title, aim, question] = this.words[this.at];
    $("tour").hidden = false;
    $("tour-title").textContent = t("tour_title", { k: this.at + 1, n: this.steps.length, title });
    $("tour-aim").textContent = aim;
    $("tour-question").textContent = question;
    $("tour-back").disabled = this.at === 0;
    $("tour-next").textContent = t(this.at + 1 < this.steps.length ? "tour_next" : "tour_end");
    this.steps[this.at]();
    $("tour-next").focus();
  }

  end() {
    $("tour").hidden = true;
    $("tour-begin").focus();
  }
}
