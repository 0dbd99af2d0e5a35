// Phase space, turned with the mouse, and the path of the centre.
import { Axes, Canvas, COLOURS, GRID, INK, line, SOFT, span, ticks } from "./plot.js";
import { fading } from "./trail.js";

export class PhaseView extends Canvas {
  constructor(element) {
    super(element);
    this.turn = [-0.7, 0.38];
    this.reach = [1e-9, 1e-9, 1e-9];
    let from = null;
    element.addEventListener("pointerdown", (e) => {
      from = [e.clientX, e.clientY];
      element.setPointerCapture(e.pointerId);
    });
    element.addEventListener("pointermove", (e) => {
      if (!from) return;
      this.rotate((e.clientX - from[0]) * 0.009, (e.clientY - from[1]) * 0.009);
      from = [e.clientX, e.clientY];
    });
    for (const name of ["pointerup", "pointercancel"]) element.addEventListener(name, () => (from = null));
    element.addEventListener("keydown", (e) => {
      const by = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] }[e.key];
      if (!by) return;
      this.rotate(...by);
      e.preventDefault();
      e.stopPropagation();
    });
  }

  rotate(around, up) {
    this.turn = [this.turn[0] + around, Math.max(-1.5, Math.min(1.5, this.turn[1] + up))];
  }

  forget() {
    this.reach = [1e-9, 1e-9, 1e-9];
  }

  /** Trails hold [first coordinate, y, z]; the first is J or omega. */
  draw(trails, labels) {
    if (!this.fit()) return;
    const c = this.context, [a, e] = this.turn;
    for (const trail of trails) {
      trail.each((o) => {
        for (let j = 0; j < 3; j++) this.reach[j] = Math.max(this.reach[j], Math.abs(trail.rows[o + j]));
      });
    }
    const size = Math.min(this.width, this.height) * 0.31;
    const [ca, sa, ce, se] = [Math.cos(a), Math.sin(a), Math.cos(e), Math.sin(e)];
    const project = (x, y, z) => {
      const [p, q, r] = [x / this.reach[0], y / this.reach[1], z / this.reach[2]];
      const depth = -p * sa + q * ca;
      return [this.width / 2 + size * (p * ca + q * sa), this.height / 2 - size * (r * ce - depth * se)];
    };
    this.clear();
    this.frame(c, project, labels);
    for (const [k, trail] of [...trails.entries()].reverse()) {
      fading(c, trail, (rows, o) => project(rows[o], rows[o + 1], rows[o + 2]), COLOURS[k], 1.6);
    }
    for (const [k, trail] of trails.entries()) {
      if (!trail.count) continue;
      const o = ((trail.next - 1 + trail.most) % trail.most) * trail.columns;
      const [x, y] = project(trail.rows[o], trail.rows[o + 1], trail.rows[o + 2]);
      c.fillStyle = COLOURS[k];
      c.beginPath();
      c.arc(x, y, 4.5, 0, 2 * Math.PI);
      c.fill();
    }
  }

  /** The box of a text [left, top, right, bottom] about a point, within the canvas. */
  box(c, text, x, y) {
    const half = c.measureText(text).width / 2, high = this.text / 2;
    const centre = Math.max(half + 2, Math.min(this.width - half - 2, x));
    return [centre - half, y - high, centre + half, y + high];
  }

  /** Write a text unless it would touch one that is there; `boxes` lists these. */
  write(c, text, box) {
    if (this.boxes.some(([l, t, r, b]) => box[0] < r + 2 && box[2] > l - 2 && box[1] < b && box[3] > t)) return;
    this.boxes.push(box);
    c.fillText(text, (box[0] + box[2]) / 2, (box[1] + box[3]) / 2);
  }

  frame(c, project, labels) {
    const [x, y, z] = this.reach;
    const corner = (k) => project(k & 1 ? x : -x, k & 2 ? y : -y, k & 4 ? z : -z);
    c.strokeStyle = GRID;
    c.lineWidth = 1;
    for (let k = 0; k < 8; k++) {
      for (const bit of [1, 2, 4]) if (!(k & bit)) line(c, ...corner(k), ...corner(k | bit));
    }
    const font = (size) => `${size}px "Source Sans 3", "Helvetica Neue", Arial, sans-serif`;
    const ends = [[x, 0, 0], [0, y, 0], [0, 0, z]];
    this.boxes = [];
    c.strokeStyle = "#9a9a9a";
    c.fillStyle = INK;
    c.font = font(this.text * 1.1);
    c.textAlign = "center";
    c.textBaseline = "middle";
    // The axes' names first: a number that would touch a name is left out.
    for (const [k, end] of ends.entries()) {
      line(c, ...project(...end.map((v) => -v)), ...project(...end));
      const [name, unit] = labels[k];
      const text = unit ? `${name} [${unit}]` : name;
      const [px, py] = project(...end.map((v) => 1.15 * v));
      const half = c.measureText(text).width / 2;
      const aside = k === 2 ? 0 : px < this.width / 2 ? -half : half;
      this.write(c, text, this.box(c, text, px + aside, k === 2 ? py - this.text : py));
    }
    c.fillStyle = SOFT;
    c.font = font(this.text * 0.88);
    for (const [k, end] of ends.entries()) {
      const most = this.reach[k] * labels[k][2];
      for (const [value, text] of ticks(-most, most, 3)) {
        if (Math.abs(value) < 0.3 * most) continue;
        const [px, py] = project(...end.map((v) => (v ? value / labels[k][2] : 0)));
        c.fillRect(px - 1.5, py - 1.5, 3, 3);
        this.write(c, text, this.box(c, text, px, py + this.text * 0.85));
      }
    }
  }
}

export class PlaneView extends Axes {
  /** `edge`: the circle beyond which the wheels lose the disk. */
  draw(trails, scale, edge, labels) {
    if (!this.fit()) return;
    const reach = 1.06 * edge * scale;
    const c = this.begin([-reach, reach, -reach, reach], ...labels, { equal: true });
    this.clipped(() => {
      c.setLineDash([6, 5]);
      c.strokeStyle = "#9a9a9a";
      c.beginPath();
      c.arc(this.x(0), this.y(0), this.x(edge * scale) - this.x(0), 0, 2 * Math.PI);
      c.stroke();
      c.setLineDash([]);
      c.strokeStyle = SOFT;
      line(c, this.x(0) - 6, this.y(0), this.x(0) + 6, this.y(0));
      line(c, this.x(0), this.y(0) - 6, this.x(0), this.y(0) + 6);
      for (const [k, trail] of [...trails.entries()].reverse()) {
        fading(c, trail, (rows, o) => [this.x(scale * rows[o + 1]), this.y(scale * rows[o + 2])], COLOURS[k], 1.6);
      }
    });
  }
}

export { span };
