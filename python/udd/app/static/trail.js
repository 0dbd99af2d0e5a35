// What was passed lately, for drawing: the last states, over changes of the model too.
export class Trail {
  constructor(most, columns) {
    this.most = most;
    this.columns = columns;
    this.rows = new Float64Array(most * columns);
    this.clear();
  }

  clear() {
    this.count = 0;
    this.next = 0;
  }

  push(values) {
    this.rows.set(values, this.next * this.columns);
    this.next = (this.next + 1) % this.most;
    this.count = Math.min(this.count + 1, this.most);
  }

  /** Calls with each row's offset from the oldest to the newest. */
  each(call) {
    const first = (this.next - this.count + this.most) % this.most;
    for (let k = 0; k < this.count; k++) call(((first + k) % this.most) * this.columns, k);
  }
}

const BANDS = 16;

/** A line that fades towards the past; `place` gives a row's place on the canvas. */
export function fading(c, trail, place, colour, width) {
  c.strokeStyle = colour;
  c.lineWidth = width;
  c.lineJoin = "round";
  let band = -1, before = null;
  trail.each((offset, k) => {
    const [x, y] = place(trail.rows, offset);
    const own = Math.floor((BANDS * k) / trail.count);
    if (own !== band) {
      if (band >= 0) {
        c.lineTo(x, y);
        c.stroke();
      }
      band = own;
      c.globalAlpha = 0.08 + (0.85 * (band + 1)) / BANDS;
      c.beginPath();
      c.moveTo(x, y);
    } else c.lineTo(x, y);
    before = [x, y];
  });
  if (before) c.stroke();
  c.globalAlpha = 1;
}
