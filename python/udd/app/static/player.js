// A run as it is played: states come in pieces and are kept ahead of what is shown.
const AHEAD = 4; // pieces to have, of which at least three are not yet shown
const PIECE = 120; // states: half a second

/** States of one run, as they came. */
class Record {
  constructor(columns) {
    this.columns = columns;
    this.rows = new Float64Array(columns * 4096);
    this.count = 0;
    this.end = null;
  }

  add(first, body) {
    if (first !== this.count) return; // asked for twice, after a break
    const size = (this.count * this.columns) + body.length;
    if (size > this.rows.length) {
      const larger = new Float64Array(Math.max(size, 2 * this.rows.length));
      larger.set(this.rows.subarray(0, this.count * this.columns));
      this.rows = larger;
    }
    this.rows.set(body, this.count * this.columns);
    this.count += body.length / this.columns;
  }

  row(k) {
    return this.rows.subarray(k * this.columns, (k + 1) * this.columns);
  }

  /** Between states: a cubic through the four nearest (Catmull and Rom). */
  at(x, out) {
    const k = Math.max(0, Math.min(Math.floor(x), this.count - 1));
    const f = Math.min(Math.max(x - k, 0), 1);
    const n = this.columns;
    const [a, b, c, d] = [k - 1, k, k + 1, k + 2].map((i) => Math.max(0, Math.min(i, this.count - 1)) * n);
    for (let j = 0; j < n; j++) {
      const [p, q, r, s] = [this.rows[a + j], this.rows[b + j], this.rows[c + j], this.rows[d + j]];
      out[j] = q + 0.5 * f * (r - p + f * (2 * p - 5 * q + 4 * r - s + f * (3 * (q - r) + s - p)));
    }
    return out;
  }
}

export class Player {
  constructor(link) {
    this.link = link;
    this.generation = 0;
    this.records = [null, null];
    this.asked = [0, 0];
    this.at = 0;
    this.speed = 1;
    this.playing = true;
    this.fresh = false; // a new run whose first piece is not there yet
    this.listeners = [];
    link.on("open", () => this.resume());
    link.on("piece", (message) => this.take(message));
    link.on("run", (message) => {
      if (message.generation === this.generation) this.motor = message.motor;
    });
    link.on("end", (message) => {
      const record = this.records[message.run];
      if (message.generation === this.generation && record) record.end = message;
    });
  }

  /** Begin a run; the second disk where `twin` is a state. */
  start(model, columns, rate, state, twin) {
    this.generation += 1;
    this.model = model;
    this.rate = rate;
    this.starts = [state, twin];
    this.columns = columns;
    this.records = [new Record(columns.length), twin ? new Record(columns.length) : null];
    this.asked = [0, 0];
    this.at = 0;
    this.fresh = true;
    this.failed = null; // why the run cannot be computed
    this.since = performance.now();
    this.feed();
  }

  take({ generation, numbers: [run, first], body }) {
    if (generation !== this.generation || !this.records[run]) return;
    this.records[run].add(first, body);
    if (this.records.every((r) => !r || r.count)) this.fresh = false;
  }

  /** Ask for what will soon be shown. */
  feed() {
    const piece = Math.min(4096, Math.ceil(PIECE * Math.max(1, this.speed)));
    this.starts?.forEach((state, run) => {
      const record = this.records[run];
      if (!record || record.end) return;
      while (this.asked[run] < this.at + AHEAD * piece) {
        const question = { type: "run", generation: this.generation, run, model: this.model, state };
        this.link.say({ ...question, first: this.asked[run], count: piece });
        this.asked[run] += piece;
      }
    });
  }

  /** After a break: ask again for all that did not come. */
  resume() {
    this.records.forEach((record, run) => (this.asked[run] = record?.count ?? 0));
    this.feed();
  }

  /** Move on by so many seconds; how many states can be shown is never exceeded. */
  advance(seconds) {
    if (this.fresh || !this.records[0]) return;
    this.at = Math.min(this.at + seconds * this.speed * this.rate, this.last);
    this.feed();
  }

  get last() {
    return Math.max(0, Math.min(...this.records.filter(Boolean).map((r) => r.count - 1)));
  }

  /** What ended the run, once it is shown. */
  get ended() {
    if (this.fresh) return null;
    return this.records.map((r) => (r?.end && this.at >= r.count - 1 ? r.end : null)).find(Boolean) ?? null;
  }

  /** Pieces that are there and not yet shown. */
  get ahead() {
    return (this.last - this.at) / (PIECE * Math.max(1, this.speed));
  }

  /** The state shown last, bit by bit as udd.simulate gave it. */
  exact(count) {
    return Array.from(this.records[0].row(Math.floor(this.at)).subarray(0, count));
  }
}
