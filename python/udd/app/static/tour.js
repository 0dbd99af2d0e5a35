// A tour of six steps, each with an aim and a question; the page stays usable meanwhile.
import { list, t } from "./texts.js";

const $ = (id) => document.getElementById(id);

export class Tour {
  /** `steps`: functions that prepare the page for each step and return the element to look at. */
  constructor(steps) {
    this.steps = steps;
    this.words = list("tour_steps");
    // On a narrow screen the page scrolls to what a step shows, again as that grows, until the reader acts.
    this.sized = new ResizeObserver(([{ target }]) => target.scrollIntoView({ block: "start" }));
    for (const act of ["pointerdown", "wheel", "keydown"]) addEventListener(act, () => this.sized.disconnect(), { passive: true });
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
    const last = this.at + 1 === this.steps.length;
    $("tour-next").textContent = t(last ? "tour_end" : "tour_next");
    $("tour-end").hidden = last;
    const shown = this.steps[this.at]();
    $("tour-next").focus();
    document.body.style.setProperty("--tour", `${$("tour").offsetHeight + 16}px`);
    this.sized.disconnect();
    if (shown) this.sized.observe(shown);
  }

  end() {
    $("tour").hidden = true;
    $("tour-begin").focus();
  }
}
