// The disk between its wheels, seen from the front, as the device's films show it.
import { Canvas, COLOURS } from "./plot.js";
import { fading } from "./trail.js";

const MARKS = ["#e41a1c", "#ff9f1c", "#2b6cff", "#1fae4b"]; // clockwise from the one at beta: the device's own
const PLACE = 65 / 80, SIDE = 16 / 80; // of the radius
const [NEAR, FAR] = [1.3, 1.98]; // radii shown to each side: at least and at most

export class DiskView extends Canvas {
  /** `moved` is told where the disk is dragged to, and whether it is let go. */
  constructor(element, moved) {
    super(element);
    this.moved = moved;
    this.held = null;
    this.reach = FAR;
    // A finger on the disk drags it; beside it, it scrolls the page.
    element.addEventListener("touchstart", (e) => this.over(e.touches[0]) && e.preventDefault(), { passive: false });
    element.addEventListener("pointerdown", (e) => this.down(e));
    element.addEventListener("pointermove", (e) => this.move(e));
    element.addEventListener("pointerup", (e) => this.up(e));
    element.addEventListener("pointercancel", (e) => this.up(e));
  }

  over(e) {
    const [y, z] = this.place(e);
    return Math.hypot(y - this.centre[0], z - this.centre[1]) <= this.radius;
  }

  down(e) {
    const [y, z] = this.place(e);
    if (!this.over(e)) return;
    this.held = [this.centre[0] - y, this.centre[1] - z];
    this.element.setPointerCapture(e.pointerId);
    this.element.classList.add("dragging");
    this.moved(this.within(...this.centre), false);
  }

  move(e) {
    if (!this.held) return;
    const [y, z] = this.place(e);
    this.moved(this.within(y + this.held[0], z + this.held[1]), false);
  }

  up(e) {
    if (!this.held) return;
    const [y, z] = this.place(e);
    const to = this.within(y + this.held[0], z + this.held[1]);
    this.held = null;
    this.element.classList.remove("dragging");
    this.moved(to, true);
  }

  /** A place at which the wheels still hold the disk. */
  within(y, z) {
    const far = Math.hypot(y, z) / (0.97 * this.radius);
    return far > 1 ? [y / far, z / far] : [y, z];
  }

  place(e) {
    const box = this.element.getBoundingClientRect();
    return [(e.clientX - box.left - this.width / 2) / this.unit, -(e.clientY - box.top - this.height / 2) / this.unit];
  }

  /** `disks`: [y, z, beta, trail] each, in the model's length; `lift`: how far the wheels have turned. */
  draw(radius, disks, lift) {
    if (!this.fit()) return;
    const c = this.context;
    this.radius = radius;
    this.centre = disks[0].slice(0, 2);
    this.zoom(disks);
    this.unit = Math.min(this.width, this.height) / 2 / this.reach / radius;
    this.clear();
    c.save();
    c.translate(this.width / 2, this.height / 2);
    for (const [k, [y, z, beta]] of [...disks.entries()].reverse()) this.disk(c, y, z, beta, radius * this.unit, k);
    for (const [k, disk] of [...disks.entries()].reverse()) {
      if (disk[3]) fading(c, disk[3], (rows, o) => [rows[o + 1] * this.unit, -rows[o + 2] * this.unit], COLOURS[k], 1.8);
    }
    this.wheels(c, lift * this.unit, radius * this.unit);
    for (const [k, [y, z]] of disks.entries()) {
      c.fillStyle = COLOURS[k];
      c.beginPath();
      c.arc(y * this.unit, -z * this.unit, 4, 0, 2 * Math.PI);
      c.fill();
    }
    c.restore();
  }

  /** Show as much as the disks have needed lately: more at once, less slowly. */
  zoom(disks) {
    if (this.held) return; // a dragged disk stays under the finger
    let far = 0;
    for (const [y, z, , trail] of disks) {
      far = Math.max(far, Math.hypot(y, z));
      trail?.each((o) => (far = Math.max(far, Math.hypot(trail.rows[o + 1], trail.rows[o + 2]))));
    }
    const want = Math.min(FAR, Math.max(NEAR, 1.06 + far / this.radius));
    this.reach = want > this.reach ? want : this.reach + 0.02 * (want - this.reach);
  }

  disk(c, y, z, beta, r, k) {
    c.save();
    c.translate(y * this.unit, -z * this.unit);
    c.rotate(beta);
    c.globalAlpha = k ? 0.45 : 1;
    c.beginPath();
    c.arc(0, 0, r, 0, 2 * Math.PI);
    c.fillStyle = k ? "#fbeee3" : "#fafafa";
    c.fill();
    c.lineWidth = 2;
    c.strokeStyle = k ? COLOURS[1] : "#6a6a6a";
    c.stroke();
    const side = SIDE * r;
    for (const colour of MARKS) {
      c.fillStyle = colour;
      c.fillRect(-side / 2, -PLACE * r - side / 2, side, side);
      c.rotate(Math.PI / 2);
    }
    c.restore();
  }

  /** The wheel in front, seen on its edge; its tread moves up with the disk's material. */
  wheels(c, lift, r) {
    const [w, h] = [0.11 * r, 0.3 * r];
    c.save();
    c.globalAlpha = 0.88;
    c.fillStyle = "#3c3c3c";
    c.fillRect(-w / 2, -h, w, 2 * h);
    c.globalAlpha = 1;
    c.strokeStyle = "#bdbdbd";
    c.lineWidth = 1.5;
    c.beginPath();
    for (let k = 0; k < 12; k++) {
      const phase = (((lift / h + (k * Math.PI) / 12) % Math.PI) + Math.PI) % Math.PI;
      const at = h * Math.cos(phase);
      c.moveTo(-w / 2, at);
      c.lineTo(w / 2, at);
    }
    c.stroke();
    c.restore();
  }
}
