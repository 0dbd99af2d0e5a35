// How the page looks: projector, dark or light. It is kept over a reload, as is what was open.
import { recolour } from "./plot.js";

const $ = (id) => document.getElementById(id);

/** What this tab of the browser remembers over a reload. */
export function remember(name, value) {
  try {
    sessionStorage.setItem(`udd-${name}`, value);
  } catch {} // a browser may keep nothing
}

export function recalled(name) {
  try {
    return sessionStorage.getItem(`udd-${name}`);
  } catch {
    return null;
  }
}

export class Look {
  constructor() {
    this.system = matchMedia("(prefers-color-scheme: dark)");
    this.system.addEventListener("change", () => this.show());
    $("dark").addEventListener("click", () => this.dark());
    if (recalled("projector") === "1") document.body.classList.add("projector");
    this.show();
  }

  get isDark() {
    return (recalled("theme") ?? (this.system.matches ? "dark" : "light")) === "dark";
  }

  dark() {
    remember("theme", this.isDark ? "light" : "dark");
    this.show();
  }

  /** Larger for a room: the whole screen, and the disk before all else. */
  projector() {
    const on = document.body.classList.toggle("projector");
    remember("projector", on ? "1" : "0");
    const done = on ? document.documentElement.requestFullscreen?.() : document.fullscreenElement && document.exitFullscreen();
    done?.catch?.(() => {}); // not every browser and place allows it
    this.show();
  }

  show() {
    document.documentElement.dataset.theme = this.isDark ? "dark" : "light";
    $("dark").setAttribute("aria-pressed", String(this.isDark));
    $("projector").setAttribute("aria-pressed", String(document.body.classList.contains("projector")));
    recolour();
  }
}
