// The state of the page in its address: numbers are written so that they come back as the same bits.
import { parse } from "./numbers.js";
import { t } from "./texts.js";

const FAR = 10; // times the end of its slider: further a number is changed

/** The run that stands behind the # of the address; null where there is none. Throws what cannot be read. */
export function read(hash, catalogue) {
  const given = new URLSearchParams(hash.replace(/^#/, ""));
  const kind = given.get("model");
  if (kind === null) return null;
  const about = catalogue.models[kind];
  if (!about) throw new Error(t("link_model", { text: kind }));
  const model = { kind };
  const changed = [];
  for (const [k, p] of about.parameters.entries()) {
    model[p.name] = given.has(p.name) ? number(p.name, given.get(p.name)) : p.default;
    if (k === 0) model[p.name] = within(p, model[p.name], changed); // the drive
  }
  if (kind === "disk") {
    model.edge = given.get("edge") === "ignore" ? "ignore" : "stop";
    model.effects = given.getAll("effect").map(effectOf);
  }
  const parts = (given.get("state") ?? "").split(",");
  if (parts.length !== about.states.length) throw new Error(t("link_state", { n: about.states.length, text: given.get("state") ?? "" }));
  const state = parts.map((part) => number("state", part));
  const speed = given.has("speed") ? number("speed", given.get("speed")) : 1;
  return { model, state, twin: given.get("twin") === "1", tab: given.get("tab"), speed, changed };
}

/** A drive of a link; one far beyond its range, as a speed in other units is, is changed, and that is noted. */
function within(about, value, changed) {
  const most = FAR * about.most;
  if (value <= most && value >= Math.min(0, about.least)) return value;
  const kept = value > most ? about.most : about.least;
  const text = (v) => `${+(v * about.scale).toPrecision(6)} ${about.unit}`.trim();
  changed.push(t("link_changed", { name: about.name, from: text(value), to: text(kept) }));
  return kept;
}

function number(name, text) {
  const value = parse(text);
  if (Number.isNaN(value)) throw new Error(t("link_number", { name, text }));
  return value;
}

function effectOf(text) {
  const [name, rest] = [text.split(":")[0], text.split(":").slice(1).join(":")];
  const effect = { name };
  for (const part of rest.split(",").filter(Boolean)) {
    const [key, value = ""] = part.split("=");
    effect[key] = key === "momentum" || key === "treatment" ? value : number(`${name} ${key}`, value);
  }
  return effect;
}

/** The address of a run. */
export function write({ model, state, twin, tab, speed }, catalogue) {
  const out = new URLSearchParams({ model: model.kind });
  for (const p of catalogue.models[model.kind].parameters) out.set(p.name, String(model[p.name]));
  if (model.edge === "ignore") out.set("edge", "ignore");
  for (const { name, ...rest } of model.effects ?? []) {
    out.append("effect", `${name}:${Object.entries(rest).map(([k, v]) => `${k}=${v}`).join(",")}`);
  }
  out.set("state", state.map(String).join(","));
  if (twin) out.set("twin", "1");
  if (tab) out.set("tab", tab);
  if (speed && speed !== 1) out.set("speed", String(speed));
  return `#${out.toString().replaceAll("%2C", ",").replaceAll("%3A", ":").replaceAll("%3D", "=")}`;
}

/** The same run in Python. */
export function python({ model, state }, catalogue) {
  const { kind, effects = [], edge, ...numbers } = model;
  const drive = kind === "dle" ? "w" : "W";
  const rest = Object.entries(numbers).filter(([name]) => name !== drive).map(([n, v]) => `${n}=${v}`);
  const made = effects.map(({ name, ...values }) => {
    const list = Object.entries(values).map(([n, v]) => `${n}=${typeof v === "string" ? `"${v}"` : v}`);
    return `udd.effects.${name}(${list.join(", ")})`;
  });
  if (made.length) rest.push(`effects=[${made.join(", ")}]`);
  if (edge === "ignore") rest.push('edge="ignore"');
  const call = kind === "dle" ? "udd.DLE" : "udd.Disk";
  const per = catalogue.models[kind].per_unit;
  return [
    "import numpy as np",
    "import udd",
    "",
    "n = 10_000  # states; a run twice as long, as its last step is cut to its end",
    `t = np.arange(2 * n) / ${per}`,
    `run = udd.simulate(${call}(${[numbers[drive], ...rest].join(", ")}), t, [${state.join(", ")}], method="dopri5")`,
    "t, state = t[:n], run.state[:n]",
    "",
  ].join("\n");
}
