// The Poincaré section and the return map, filling while they are looked at.
import { Axes, COLOURS, FAINT, span } from "./plot.js";
import { t } from "./texts.js";

export class Sections {
  constructor(link, page) {
    this.link = link;
    this.page = page;
    this.generation = 0;
    this.points = new Float64Array(0);
    this.section = new Axes(document.getElementById("section"));
    this.return = new Axes(document.getElementById("return"));
    this.said = document.getElementById("section-said");
    this.select = document.getElementById("surface");
    this.select.addEventListener("change", () => this.ask());
    link.on("section-points", ({ generation, numbers, body }) => {
      if (generation !== this.generation) return;
      this.dim = numbers[1];
      this.points = body;
      this.dirty = true;
    });
    link.on("section", (message) => {
      if (message.generation !== this.generation) return;
      const key = message.outcome === "finished" ? "crossings" : "crossings_ended";
      const none = message.found === 0 && t(`section_none_${this.select.value}_${this.page.home.model.kind}`);
      this.said.textContent = none || t(key, { n: message.found, outcome: message.outcome });
    });
    link.on("open", () => (this.key = ""));
  }

  /** What can be chosen for this model. */
  offer(kind) {
    const surfaces = Object.keys(this.page.about(kind).surfaces);
    const chosen = this.select.selectedIndex;
    this.select.replaceChildren(...surfaces.map((s) => new Option(t(`surface_${s}_${kind}`), s)));
    this.select.selectedIndex = Math.max(0, chosen);
  }

  /** Ask anew if anything has changed. */
  update() {
    const { model, state } = this.page.home;
    const key = JSON.stringify([model, state, this.select.value]);
    if (key === this.key) return;
    this.key = key;
    this.ask();
  }

  ask() {
    const { model, state } = this.page.home;
    this.generation += 1;
    this.model = model;
    this.link.say({
      type: "section",
      generation: this.generation,
      model,
      state,
      surface: this.select.value,
      count: this.page.catalogue.limits.points,
    });
  }

  draw() {
    const about = this.page.about(this.model?.kind ?? this.page.home.model.kind);
    const fits = [this.section.fit(), this.return.fit()];
    if (!fits.every(Boolean) || !(this.dirty || this.section.blank || this.return.blank)) return;
    this.dirty = false;
    const names = about.states;
    const surface = this.select.value;
    const across = surface === "reversals" ? 1 : names.indexOf(names[1]);
    const up = surface === "reversals" ? 2 : 0;
    const rows = this.dim ? this.points.length / this.dim : 0;
    const column = (j) => {
      const scale = this.page.scale(names[j]);
      return Array.from({ length: rows }, (_, k) => scale * this.points[k * this.dim + j]);
    };
    const [x, y] = [column(across), column(up)];
    let c = this.section.begin([...span(x), ...span(y)], t(`axis_${names[across]}`), t(`axis_${names[up]}`));
    dots(this.section, c, x, y, rows);
    const own = about.surfaces[surface];
    const value = column(names.indexOf(own));
    const range = span(value);
    const label = t(`axis_${own}`);
    c = this.return.begin([...range, ...range], t("return_now", { x: label }), t("return_next", { x: label }));
    c.strokeStyle = FAINT;
    this.return.clipped(() => {
      c.beginPath();
      c.moveTo(this.return.x(range[0]), this.return.y(range[0]));
      c.lineTo(this.return.x(range[1]), this.return.y(range[1]));
      c.stroke();
    });
    dots(this.return, c, value, value.slice(1), rows - 1);
  }
}

function dots(axes, c, x, y, count) {
  // A cycle crosses in a few places however many points there are: large dots where few places are taken.
  const places = new Set();
  for (let k = 0; k < count; k++) places.add(`${Math.round(axes.x(x[k]))} ${Math.round(axes.y(y[k]))}`);
  const size = places.size > 3000 ? 1.3 : places.size > 600 ? 1.8 : places.size > 60 ? 3 : 6;
  c.fillStyle = COLOURS[0];
  for (let k = 0; k < count; k++) c.fillRect(axes.x(x[k]) - size / 2, axes.y(y[k]) - size / 2, size, size);
}
