// A time series of the run: one quantity over another, over the last half minute.
import { Axes, COLOURS, span } from "./plot.js";
import { t } from "./texts.js";

const SHOWN = 1500; // points of a curve
const LAST = 30; // s on the clock of the wall
const LEFT_OUT = ["friction_work", "effects_work"];

export class Series {
  constructor(page) {
    this.page = page;
    this.axes = new Axes(document.getElementById("series"));
    this.up = document.getElementById("series-up");
    this.across = document.getElementById("series-across");
    this.hint = document.getElementById("series-hint");
  }

  /** What can be chosen for this model. */
  offer(kind) {
    const names = this.page.about(kind).columns.filter((name) => !LEFT_OUT.includes(name));
    const options = (all) => all.map((name) => new Option(this.label(name, kind), name));
    this.up.replaceChildren(...options(names));
    this.across.replaceChildren(...options(["t", ...names]));
    this.up.selectedIndex = 0;
    this.across.selectedIndex = 0;
    this.hint.textContent = t("series_hint", { t: kind === "disk" ? t("second", { x: LAST }) : t("unit_of_time", { x: Math.round(LAST * this.page.about(kind).clock) }) });
  }

  label(name, kind) {
    if (name === "t") return t(`axis_t_${kind}`);
    if (name === "friction" && kind === "disk") return `${t("axis_friction")} [${t("energy_unit_disk")}]`;
    return t(`axis_${name}`);
  }

  draw(player) {
    if (!this.axes.fit() || player.fresh || !player.records[0]) return;
    const { kind } = player.model;
    const about = this.page.about(kind);
    const now = Math.floor(player.at);
    const first = Math.max(0, now - LAST * player.rate);
    const step = Math.max(1, Math.ceil((now - first) / SHOWN));
    const at = (name) => {
      if (name === "t") return (row, k) => k / about.per_unit;
      const [column, scale] = [player.columns.indexOf(name), this.page.scale(name)];
      return (row) => scale * row[column];
    };
    const [x, y] = [at(this.across.value), at(this.up.value)];
    const curves = player.records.filter(Boolean).map((record) => {
      const curve = [[], []];
      for (let k = first; k <= Math.min(now, record.count - 1); k += step) {
        const row = record.row(k);
        curve[0].push(x(row, k));
        curve[1].push(y(row, k));
      }
      return curve;
    });
    const range = (j) => curves.flatMap((curve) => curve[j]);
    const across = this.across.value === "t" ? [first / about.per_unit, Math.max(now, first + 1) / about.per_unit] : span(range(0));
    const c = this.axes.begin([...across, ...span(range(1))], this.label(this.across.value, kind), this.label(this.up.value, kind));
    this.axes.clipped(() => {
      for (const [n, [xs, ys]] of [...curves.entries()].reverse()) {
        c.strokeStyle = COLOURS[n];
        c.lineWidth = 1.6;
        c.beginPath();
        xs.forEach((v, k) => c.lineTo(this.axes.x(v), this.axes.y(ys[k])));
        c.stroke();
      }
    });
  }
}
