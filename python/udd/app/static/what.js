// What is this? The drawing, the equations with the numbers of this moment, and every symbol.
import { list, t } from "./texts.js";

const RAISED = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };

/** A number with three digits, as 3.63·10⁻⁷ where it is very small. */
export function number(x) {
  if (Math.abs(x) < 5e-13) return "0";
  const [digits, power] = String(+x.toPrecision(3)).split("e");
  const raised = power ? `·10${[...power].map((c) => RAISED[c]).join("")}` : "";
  return `${digits.replace("-", "−")}${raised}`;
}

/** The same behind a sign: a negative number stands in brackets. */
const signed = (x) => (x < -5e-13 ? `(${number(x)})` : number(x));

export class What {
  /** `laws`: the library's effects, with their equations. */
  constructor(laws) {
    this.laws = laws;
    this.box = document.getElementById("equations");
    this.symbols = document.getElementById("symbols");
    this.last = 0;
  }

  draw(model, row, about) {
    if (performance.now() - this.last < 200) return;
    this.last = performance.now();
    const state = Object.fromEntries(about.states.map((name, k) => [name, row[k]]));
    const lines = model.kind === "disk" ? disk(model, state, this.laws) : dle(model, state);
    this.box.replaceChildren(...lines.map(([law, now]) => {
      const p = document.createElement("p");
      const b = document.createElement("b");
      b.textContent = law;
      const span = document.createElement("span");
      span.textContent = now;
      p.append(b, document.createElement("br"), span);
      return p;
    }));
    if (this.kind === model.kind) return;
    this.kind = model.kind;
    this.symbols.replaceChildren(...list(model.kind === "disk" ? "symbols_disk" : "symbols_dle").flatMap(([symbol, meaning]) => ["dt", "dd"].map((tag, k) => {
      const e = document.createElement(tag);
      e.textContent = [symbol, meaning][k];
      return e;
    })));
  }
}

function disk({ W, R, g, k0, k1, k2, effects }, { Omega, Y, Z }, laws) {
  const k = Math.max(k1 - k2 * Math.abs(Omega), k0);
  const I = R ** 2 / 2 + Y ** 2 + Z ** 2;
  const turn = (g * Y - k * Omega - Z * W * Omega) / I;
  return [
    ["dY/dT = Z Ω", `= ${number(100 * Z)} cm × ${number(Omega)} rad/s = ${number(100 * Z * Omega)} cm/s`],
    ["dZ/dT = W − Y Ω", `= ${number(100 * W)} − ${signed(100 * Y)} × ${signed(Omega)} = ${number(100 * (W - Y * Omega))} cm/s`],
    ["I dΩ/dT = g Y − k Ω − W Z Ω", `= ${number(g * Y)} − ${signed(k * Omega)} − ${signed(W * Z * Omega)} m²/s², I = ${number(I)} m²: dΩ/dT = ${number(turn)} rad/s²`],
    ["k = max(k₁ − k₂ |Ω|, k₀)", `= max(${number(k1)} − ${number(k2)} × ${number(Math.abs(Omega))}, ${number(k0)}) = ${number(k)} m²/s`],
    ...(effects?.length ? [[t("what_effects"), effects.map((e) => laws.find((law) => law.name === e.name)?.equation ?? e.name).join(", ")]] : []),
  ];
}

function dle({ w, B }, { omega, y, z }) {
  return [
    ["dω/dt = y − ω", `= ${number(y)} − ${signed(omega)} = ${number(y - omega)}`],
    ["dy/dt = ω z", `= ${number(omega)} × ${signed(z)} = ${number(omega * z)}`],
    ["dz/dt = w − ω y − B w z", `= ${number(w)} − ${signed(omega * y)} − ${signed(B * w * z)} = ${number(w - omega * y - B * w * z)}`],
  ];
}
