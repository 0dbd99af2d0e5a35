// The bifurcation diagram over the drive with the exponent under it; the drive's slider is its cursor.
import { Axes, COLOURS, INK, line, span } from "./plot.js";
import { t } from "./texts.js";

const UNDECIDED = "#9a9a9a";
const STEPS = 6; // diagrams and exponents, each in three passes
const KEPT = 12;

export class Diagram {
  constructor(link, page) {
    this.link = link;
    this.page = page;
    this.generation = this.steps = 0;
    this.kept = new Map();
    this.bar = document.getElementById("diagram-bar");
    this.legend = document.getElementById("diagram-legend");
    this.axes = new Axes(document.getElementById("diagram"));
    this.below = new Axes(document.getElementById("exponent"));
    this.said = document.getElementById("diagram-said");
    this.select = document.getElementById("component");
    this.select.addEventListener("change", () => (this.dirty = true));
    document.getElementById("whole").addEventListener("click", () => this.zoom(null));
    link.on("diagram-points", (message) => this.take(message));
    link.on("exponents", ({ generation, numbers: [n], body }) => {
      if (generation !== this.generation) return;
      this.exponents = [0, 1, 2].map((k) => body.subarray(k * n, (k + 1) * n));
      this.steps += 1;
      this.dirty = true;
    });
    link.on("diagram", (message) => {
      if (message.generation === this.generation) {
        this.working = false;
        this.kept.set(this.key, [this.found, this.exponents]);
        if (this.kept.size > KEPT) this.kept.delete(this.kept.keys().next().value);
      }
      this.tell();
    });
    link.on("open", () => (this.key = ""));
    this.listen();
  }

  offer(kind) {
    const names = this.page.about(kind).states.slice(0, 2); // the third is zero on the section
    this.select.replaceChildren(...names.map((n) => new Option(t(`axis_${n}`), n)));
    this.select.selectedIndex = 1;
    this.range = null;
    this.found = this.exponents = null;
  }

  /** The parameter that is varied, as the page describes it. */
  get drive() {
    return this.page.about(this.page.home.model.kind).parameters[0];
  }

  update() {
    const { [this.drive.name]: _, ...rest } = this.page.home.model;
    const [low, high] = this.range ?? [this.drive.least * 2, this.drive.most];
    const key = JSON.stringify([rest, low, high]);
    if (key === this.key) return;
    this.key = key;
    this.generation += 1;
    this.steps = 0;
    this.working = !this.kept.has(key);
    if (!this.working) {
      [this.found, this.exponents] = this.kept.get(key);
      this.dirty = true;
      return this.tell();
    }
    const { model, state } = this.page.home;
    this.link.say({ type: "diagram", generation: this.generation, model, state, low, high });
    this.tell();
  }

  take({ generation, numbers: [starts, values, points, dim], body }) {
    if (generation !== this.generation) return;
    const at = (k, size) => body.subarray(k, k + size);
    const n = starts * values;
    this.found = {
      starts, values, points, dim,
      drive: at(0, values),
      label: at(values, n),
      period: at(values + n, n),
      rows: at(values + 2 * n, n * points * dim),
    };
    this.steps += 1;
    this.dirty = true;
  }

  zoom(range) {
    this.range = range;
    this.update();
  }

  listen() {
    const e = this.axes.element;
    const at = (event) => [event.clientX - e.getBoundingClientRect().left, event.clientY - e.getBoundingClientRect().top];
    e.addEventListener("pointerdown", (event) => {
      this.from = at(event);
      e.setPointerCapture(event.pointerId);
    });
    e.addEventListener("pointermove", (event) => {
      if (!this.from) return;
      this.to = at(event);
      this.dirty = true;
    });
    e.addEventListener("pointerup", (event) => {
      if (!this.from) return;
      const [a, b] = [this.from, at(event)];
      this.from = this.to = null;
      this.dirty = true;
      if (!this.found) return;
      if (Math.abs(a[0] - b[0]) > 8) {
        const ends = [a[0], b[0]].map((x) => this.axes.valueX(x) / this.drive.scale).sort((x, y) => x - y);
        const whole = [this.drive.least, this.drive.most];
        this.zoom([Math.max(ends[0], whole[0]), Math.min(ends[1], whole[1])]);
      } else this.jump(this.axes.valueX(b[0]) / this.drive.scale, this.axes.valueY(b[1]));
    });
    e.addEventListener("keydown", (event) => {
      const act = {
        Enter: () => this.jump(this.page.home.model[this.drive.name], null),
        "+": () => this.around(0.5),
        "-": () => this.around(2),
        0: () => this.zoom(null),
      }[event.key];
      if (!act) return;
      act();
      event.preventDefault();
      event.stopPropagation();
    });
  }

  around(factor) {
    const [low, high] = this.range ?? [this.drive.least * 2, this.drive.most];
    const middle = this.page.home.model[this.drive.name];
    const half = ((high - low) * factor) / 2;
    this.zoom([Math.max(this.drive.least, middle - half), Math.min(this.drive.most, middle + half)]);
  }

  /** Go on from a point of the diagram: the nearest one to where was clicked, or else to the present state. */
  jump(drive, value) {
    if (!this.found) return;
    const { starts, values, points, dim, drive: all, rows } = this.found;
    const j = this.page.about(this.page.home.model.kind).states.indexOf(this.select.value);
    const scale = this.page.scale(this.select.value);
    let v = 0;
    for (let k = 1; k < values; k++) if (Math.abs(all[k] - drive) < Math.abs(all[v] - drive)) v = k;
    const want = value ?? this.page.shownState()[j] * scale;
    let [best, least] = [-1, Infinity];
    for (let s = 0; s < starts; s++) {
      for (let p = 0; p < points; p++) {
        const o = ((s * values + v) * points + p) * dim;
        const far = Math.abs(scale * rows[o + j] - want);
        if (far < least) [best, least] = [o, far];
      }
    }
    if (best >= 0) this.page.jump(all[v], Array.from(rows.subarray(best, best + dim)));
  }

  tell() {
    this.bar.hidden = !this.working;
    this.bar.value = this.steps / STEPS;
    if (this.working) this.said.textContent = t("diagram_working");
    else if (this.found) {
      const now = this.page.home.model[this.drive.name];
      const { starts, values, drive, label } = this.found;
      let v = 0;
      for (let k = 1; k < values; k++) if (Math.abs(drive[k] - now) < Math.abs(drive[v] - now)) v = k;
      const here = new Set();
      for (let s = 0; s < starts; s++) if (label[s * values + v] > 0) here.add(label[s * values + v]);
      this.said.textContent = here.size ? t(here.size > 1 ? "diagram_branches" : "diagram_branch", { n: here.size }) : "";
    }
  }

  draw() {
    if (!this.axes.fit() || !this.below.fit()) return;
    const now = this.page.home.model[this.drive.name];
    if (!(this.dirty || this.axes.blank || this.below.blank || now !== this.now)) return;
    this.now = now;
    this.dirty = false;
    const scale = this.drive.scale;
    const [low, high] = (this.found ? [this.found.drive[0], this.found.drive.at(-1)] : [this.drive.least, this.drive.most]).map((x) => x * scale);
    this.points(low, high, now * scale);
    this.exponent(low, high, now * scale);
    this.tell();
  }

  points(low, high, now) {
    const name = this.select.value;
    const j = this.page.about(this.page.home.model.kind).states.indexOf(name);
    const scale = this.page.scale(name);
    const f = this.found;
    const shown = [], near = [];
    const edge = this.page.edge;
    if (f) {
      for (let o = 0; o < f.rows.length; o += f.dim) {
        const value = scale * f.rows[o + j];
        shown.push(value);
        // What is far beyond the edge need not be in the picture.
        if (Number.isFinite(value) && Math.abs(f.rows[o + 1]) < 1.4 * edge) near.push(value);
      }
    }
    const finite = near.sort((a, b) => a - b);
    const cut = (q) => finite[Math.min(finite.length - 1, Math.floor(q * finite.length))];
    const range = finite.length ? span([cut(0.001), cut(0.999)]) : [-1, 1];
    const c = this.axes.begin([low, high, ...range], "", t(`axis_${name}`), { bottom: false });
    if (!f) return;
    const colours = new Map();
    const size = f.values > 120 ? 1.4 : f.values > 30 ? 2 : 3;
    this.axes.clipped(() => {
      for (let s = 0; s < f.starts; s++) {
        for (let v = 0; v < f.values; v++) {
          const label = f.label[s * f.values + v];
          if (label > 0 && !colours.has(label)) colours.set(label, COLOURS[colours.size % COLOURS.length]);
          c.fillStyle = label > 0 ? colours.get(label) : UNDECIDED;
          const x = this.axes.x(f.drive[v] * this.drive.scale) - size / 2;
          for (let p = 0; p < f.points; p++) {
            const y = shown[(s * f.values + v) * f.points + p];
            if (Number.isFinite(y)) c.fillRect(x, this.axes.y(y) - size / 2, size, size);
          }
        }
      }
      this.name(colours);
      if (j === 1 && Number.isFinite(edge)) {
        c.setLineDash([6, 5]);
        c.strokeStyle = "#9a9a9a";
        for (const y of [-edge, edge]) line(c, 0, this.axes.y(scale * y), this.axes.width, this.axes.y(scale * y));
        c.setLineDash([]);
      }
      this.cursor(this.axes, now);
      if (this.from && this.to) {
        c.fillStyle = "#0072b233";
        c.fillRect(this.from[0], 0, this.to[0] - this.from[0], this.axes.height);
      }
    });
  }

  /** Say which colour is which attractor. */
  name(colours) {
    const key = [...colours.keys()].join();
    if (key === this.named) return;
    this.named = key;
    this.legend.replaceChildren(...[...colours.entries()].slice(0, 8).map(([label, colour], k) => {
      const span = document.createElement("span");
      const dot = document.createElement("span");
      dot.textContent = "■ ";
      dot.style.color = colour;
      span.append(dot, t("attractor", { n: k + 1 }), " ");
      return span;
    }));
  }

  exponent(low, high, now) {
    const e = this.exponents;
    const range = e ? span([0, ...Array.from(e[1]).filter(Number.isFinite)], 0.12) : [-0.1, 0.5];
    const unit = this.page.home.model.kind === "disk" ? ` [${t("exponent_unit_disk")}]` : "";
    const c = this.below.begin([low, high, ...range], t(`axis_${this.drive.name}`), t("exponent") + unit);
    this.below.clipped(() => {
      c.strokeStyle = "#8a8a8a";
      line(c, this.below.x(low), this.below.y(0), this.below.x(high), this.below.y(0));
      if (e) {
        c.lineWidth = 1;
        for (let k = 0; k < e[0].length; k++) {
          const x = this.below.x(e[0][k] * this.drive.scale);
          c.strokeStyle = "#9cc8e3";
          line(c, x, this.below.y(e[1][k] - e[2][k]), x, this.below.y(e[1][k] + e[2][k]));
        }
        c.fillStyle = COLOURS[0];
        for (let k = 0; k < e[0].length; k++) {
          c.fillRect(this.below.x(e[0][k] * this.drive.scale) - 1, this.below.y(e[1][k]) - 1, 2, 2);
        }
      }
      this.cursor(this.below, now);
    });
  }

  cursor(axes, now) {
    const c = axes.context;
    c.strokeStyle = INK;
    c.lineWidth = 1.5;
    line(c, axes.x(now), 0, axes.x(now), axes.height);
    c.lineWidth = 1;
  }
}
