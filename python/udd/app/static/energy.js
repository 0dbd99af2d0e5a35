// The energy balance: what the motor puts in against what friction takes out.
import { Axes, COLOURS, span } from "./plot.js";
import { t } from "./texts.js";

const SHOWN = 600; // points of a curve

export class Energy {
  constructor(page) {
    this.page = page;
    this.axes = new Axes(document.getElementById("energy"));
    this.said = document.getElementById("energy-said");
    this.last = 0;
  }

  draw(player, clock) {
    if (!this.axes.fit() || player.fresh || !player.records[0]) return;
    const record = player.records[0];
    const kind = player.model.kind;
    const [power, work, other] = ["friction", "friction_work", "effects_work"].map((n) => player.columns.indexOf(n));
    const per = this.page.about(kind).per_unit;
    const motor = player.motor;
    const now = Math.floor(player.at);
    const first = Math.max(0, now - Math.round(30 * player.rate)); // the last half minute
    const step = Math.max(1, Math.ceil((now - first) / SHOWN));
    const [x, means, powers] = [[], [], []];
    for (let k = first; k <= now; k += step) {
      const row = record.row(k);
      x.push(k / per);
      powers.push(row[power]);
      means.push(k ? row[work] / (k / per) : row[power]);
    }
    const top = span([0, motor * 1.1, ...means.slice(Math.floor(means.length / 20)), ...powers.map((p) => Math.min(p, motor * 6))]);
    const unit = kind === "disk" ? ` [${t("energy_unit_disk")}]` : "";
    const axes = this.axes;
    const c = axes.begin([x[0], Math.max(x.at(-1), x[0] + 1), Math.min(0, top[0]), top[1]], t(`axis_t_${kind}`), `P${unit}`);
    const curve = (values, colour, width) => {
      c.strokeStyle = colour;
      c.lineWidth = width;
      c.beginPath();
      values.forEach((v, k) => c.lineTo(axes.x(x[k]), axes.y(v)));
      c.stroke();
    };
    axes.clipped(() => {
      curve(powers, "#e9b48f", 1);
      curve(means, COLOURS[1], 2.6);
      curve(x.map(() => motor), COLOURS[0], 2.6);
    });
    if (performance.now() - this.last > 250) {
      this.last = performance.now();
      this.tell(record.row(now), now / per, motor, [power, work, other], kind);
    }
  }

  tell(row, time, motor, [power, work, other], kind) {
    const number = (v) => v.toPrecision(3).replace("-", "−");
    const item = (key, value, colour) => {
      const span = document.createElement("span");
      const b = document.createElement("b");
      b.textContent = value;
      const dot = document.createElement("span");
      dot.textContent = "■ ";
      dot.style.color = colour;
      span.append(dot, `${key} `, b);
      return span;
    };
    const mean = time > 0 ? row[work] / time : row[power];
    const parts = [
      item(`${t("motor")} ${t(`motor_formula_${kind}`)}`, number(motor), COLOURS[0]),
      item(`${t("friction")} ${t(`friction_formula_${kind}`)}, ${t("energy_mean")}`, number(mean), COLOURS[1]),
      item(t("energy_now"), number(row[power]), "#e9b48f"),
    ];
    const has = row[other] !== 0;
    if (has) parts.push(item(t("other_effects"), number(time > 0 ? row[other] / time : 0), "#8a8a8a"));
    const hint = document.createElement("span");
    hint.className = "hint";
    hint.textContent = t(has ? "energy_hint_effects" : "energy_hint");
    this.said.replaceChildren(...parts, hint);
  }
}
