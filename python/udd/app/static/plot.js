// Canvases: sharp on any screen, with axes.
export const COLOURS = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9", "#000000", "#8c6d00"]; // Okabe and Ito
export let INK = "#1b1b1b";
export let SOFT = "#565656";
export let FAINT = "#cfcfcf";
export let GROUND = "#ffffff";
export let GRID = "#e6e6e6";

const canvases = new Set();

/** Take the colours of the page's style sheet, which knows dark and light. */
export function recolour() {
  const style = getComputedStyle(document.body);
  const read = (name) => style.getPropertyValue(name).trim();
  [INK, SOFT, FAINT, GROUND, GRID] = ["--ink", "--soft", "--faint", "--ground", "--grid"].map(read);
  const dark = document.documentElement.dataset.theme === "dark";
  [COLOURS[0], COLOURS[5], COLOURS[6]] = dark ? ["#56b4e9", "#0072b2", "#ffffff"] : ["#0072b2", "#56b4e9", "#000000"];
  for (const canvas of canvases) canvas.changed = true;
}

let ratio = null;

/** Draw with so many pixels for each of CSS, or with the screen's own (null), from the next drawing on. */
export function sharpen(pixels) {
  ratio = pixels;
  for (const canvas of canvases) canvas.changed = true;
}

/** A canvas whose units are CSS pixels. */
export class Canvas {
  constructor(element) {
    this.element = element;
    this.context = element.getContext("2d");
    this.width = this.height = 0;
    this.changed = true;
    this.blank = true; // whether nothing was drawn since its size or colours changed
    canvases.add(this);
    new ResizeObserver(() => (this.changed = true)).observe(element);
  }

  /** Fit to its place; whether there is anything to draw upon. */
  fit() {
    if (this.changed) {
      this.changed = false;
      const sharp = ratio ?? (window.devicePixelRatio || 1);
      this.width = this.element.clientWidth;
      this.height = this.element.clientHeight;
      this.element.width = Math.round(this.width * sharp);
      this.element.height = Math.round(this.height * sharp);
      this.context.setTransform(sharp, 0, 0, sharp, 0, 0);
      this.blank = true;
      this.text = parseFloat(getComputedStyle(this.element).fontSize) * 0.85;
    }
    return this.width > 20 && this.height > 20;
  }

  clear(colour = GROUND) {
    this.blank = false;
    this.context.fillStyle = colour;
    this.context.fillRect(0, 0, this.width, this.height);
  }
}

/** Round numbers between two others: about so many, but at least two. */
export function ticks(low, high, most) {
  const rough = (high - low) / Math.max(1, most);
  const power = 10 ** Math.floor(Math.log10(rough));
  const count = (x) => Math.floor(high / x + 1e-9) - Math.ceil(low / x - 1e-9) + 1;
  const steps = [0.2, 0.5, 1, 2, 5, 10].map((x) => x * power);
  const wide = steps.findIndex((x) => x >= rough);
  const step = steps[wide] && steps.slice(0, wide + 1).findLast((x) => count(x) >= 2);
  const made = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) made.push(k * step);
  const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  return made.map((x) => [x, (Math.abs(x) < step / 2 ? 0 : x).toFixed(Math.min(digits, 8)).replace("-", "−")]);
}

/** Axes on a canvas. */
export class Axes extends Canvas {
  constructor(element) {
    super(element);
    this.range = [0, 1, 0, 1];
  }

  /** Clear and draw the axes; `equal`: the same scale both ways. */
  begin([x0, x1, y0, y1], xLabel, yLabel, { equal = false, bottom = true } = {}) {
    const c = this.context, s = this.text;
    this.clear();
    this.box = [s * 4.4, s * 0.8, this.width - s * 0.9, this.height - (bottom ? s * 3 : s * 0.5)];
    const [left, top, right, low] = this.box;
    if (equal) {
      const unit = Math.max((x1 - x0) / (right - left), (y1 - y0) / (low - top));
      const [mx, my] = [(x0 + x1) / 2, (y0 + y1) / 2];
      [x0, x1] = [mx - (unit * (right - left)) / 2, mx + (unit * (right - left)) / 2];
      [y0, y1] = [my - (unit * (low - top)) / 2, my + (unit * (low - top)) / 2];
    }
    this.range = [x0, x1, y0, y1];
    c.font = `${s}px "Source Sans 3", "Helvetica Neue", Arial, sans-serif`;
    c.lineWidth = 1;
    c.strokeStyle = GRID;
    c.fillStyle = SOFT;
    c.textAlign = "center";
    c.textBaseline = "top";
    for (const [x, text] of ticks(x0, x1, (right - left) / (s * 5))) {
      const px = Math.round(this.x(x)) + 0.5;
      line(c, px, top, px, low);
      if (bottom) c.fillText(text, px, low + s * 0.35);
    }
    c.textAlign = "right";
    c.textBaseline = "middle";
    for (const [y, text] of ticks(y0, y1, Math.max(2.2, (low - top) / (s * 2.2)))) {
      const py = Math.round(this.y(y)) + 0.5;
      line(c, left, py, right, py);
      c.fillText(text, left - s * 0.35, py);
    }
    c.strokeStyle = "#8a8a8a";
    line(c, left, top, left, low);
    line(c, left, low, right, low);
    c.fillStyle = INK;
    c.textAlign = "center";
    c.textBaseline = "bottom";
    if (bottom) c.fillText(xLabel, (left + right) / 2, this.height - s * 0.15);
    c.save();
    c.translate(s * 0.2, (top + low) / 2);
    c.rotate(-Math.PI / 2);
    c.textBaseline = "top";
    c.fillText(yLabel, 0, 0);
    c.restore();
    return c;
  }

  /** Draw only within the axes. */
  clipped(draw) {
    const c = this.context, [left, top, right, low] = this.box;
    c.save();
    c.beginPath();
    c.rect(left, top, right - left, low - top);
    c.clip();
    draw(c);
    c.restore();
  }

  x(value) {
    const [left, , right] = this.box, [x0, x1] = this.range;
    return left + ((value - x0) / (x1 - x0)) * (right - left);
  }

  y(value) {
    const [, top, , low] = this.box, [, , y0, y1] = this.range;
    return low - ((value - y0) / (y1 - y0)) * (low - top);
  }

  /** The value at a pixel. */
  valueX(px) {
    const [left, , right] = this.box, [x0, x1] = this.range;
    return x0 + ((px - left) / (right - left)) * (x1 - x0);
  }

  valueY(py) {
    const [, top, , low] = this.box, [, , y0, y1] = this.range;
    return y0 + ((low - py) / (low - top)) * (y1 - y0);
  }
}

export function line(c, x0, y0, x1, y1) {
  c.beginPath();
  c.moveTo(x0, y0);
  c.lineTo(x1, y1);
  c.stroke();
}

/** The range of numbers with some room; what is not finite does not count. */
export function span(values, room = 0.06) {
  let [low, high] = [Infinity, -Infinity];
  for (const v of values) {
    if (v < low) low = v;
    if (v > high) high = v;
  }
  if (!(low <= high)) return [0, 1];
  const more = (high - low) * room || Math.abs(high) * 0.1 || 1;
  return [low - more, high + more];
}
