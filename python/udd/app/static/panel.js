// The controls: model, drive, parameters, effects, start state.
import { NumberField, shown } from "./numbers.js";
import { t } from "./texts.js";

const $ = (id) => document.getElementById(id);

/** A slider with a number beside it; `changed` is given the value in the model's unit. */
function slider(about, value, label, changed) {
  const box = document.createElement("div");
  box.className = "slider";
  const id = `p-${about.name}`;
  const scaled = (v) => +(v * about.scale).toPrecision(12);
  const digits = Math.max(0, -Math.floor(Math.log10(about.step * about.scale) + 1e-9));
  box.innerHTML = `<div class="row"><label for="${id}"></label><span class="value"><input><span class="unit"></span></span></div><input type="range">`;
  const [number, range] = box.querySelectorAll("input");
  box.querySelector("label").textContent = label;
  box.querySelector(".unit").textContent = about.unit;
  range.id = id;
  number.setAttribute("aria-label", `${label}${about.unit ? ` [${about.unit}]` : ""}`);
  for (const [key, v] of [["min", about.least], ["max", about.most], ["step", about.step]]) range[key] = v;
  const limits = { name: label, unit: about.unit, least: scaled(about.floor), most: scaled(about.most), step: scaled(about.step) };
  const field = new NumberField(number, limits, (typed) => {
    const v = +(typed / about.scale).toPrecision(12);
    show(v);
    changed(v);
  });
  const write = (v) => {
    field.show(shown(v * about.scale, digits));
    range.setAttribute("aria-valuetext", `${number.value} ${about.unit}`);
  };
  const show = (v) => {
    range.value = v;
    write(v);
  };
  range.addEventListener("input", () => {
    const v = Number(range.value);
    write(v);
    changed(v);
  });
  show(value);
  box.show = show;
  box.range = range;
  box.mark = (text) => field.mark(text);
  return box;
}

/** A field for a number under its name. */
function labelled(text, limits, changed) {
  const label = document.createElement("label");
  const span = document.createElement("span");
  span.textContent = text;
  const input = document.createElement("input");
  label.append(span, input);
  return [label, new NumberField(input, { name: text, ...limits }, changed)];
}

export class Panel {
  constructor(page) {
    this.page = page;
    this.sliders = {};
    const { presets, effects } = page.catalogue;
    $("preset").replaceChildren(new Option(t("preset_own"), ""), ...presets.map((p) => new Option(t(`preset_${p.key}`), p.key)));
    $("preset").addEventListener("change", () => {
      const chosen = presets.find((p) => p.key === $("preset").value);
      if (chosen) page.begin(structuredClone(chosen.model), chosen.state.slice());
    });
    $("model").replaceChildren(...["disk", "dle"].map((k) => new Option(t(`model_${k}`), k)));
    $("model").addEventListener("change", () => {
      const key = $("model").value === "disk" ? "chaos" : "fig12a";
      const chosen = presets.find((p) => p.key === key);
      page.begin(structuredClone(chosen.model), chosen.state.slice());
      this.preset(key);
    });
    $("add-effect").replaceChildren(new Option(t("add_effect"), ""), ...effects.map((e) => new Option(`${e.title}: ${e.equation}`, e.name)));
    $("add-effect").addEventListener("change", () => this.add($("add-effect").value));
    $("start-here").addEventListener("click", () => {
      const state = this.startState();
      if (state) page.begin(page.home.model, state);
    });
    $("panel").addEventListener("submit", (e) => e.preventDefault());
  }

  preset(key) {
    $("preset").value = key;
  }

  /** Show a model and its start. */
  show(model, state) {
    const about = this.page.about(model.kind);
    if (this.kind !== model.kind) this.make(model, about);
    for (const [name, box] of Object.entries(this.sliders)) box.show(model[name]);
    if (this.wheel) this.wheelRate(model.W);
    if (this.edge) this.edge.checked = model.edge === "ignore";
    $("effects-box").hidden = model.kind !== "disk";
    if (model.kind === "disk") this.effects(model);
    for (const [k, field] of this.fields.entries()) {
      field.show(String(+(state[k] * this.page.scale(about.states[k])).toPrecision(8)));
      field.exact = { text: field.input.value, value: state[k] };
    }
  }

  /** At which rate the paper's drive wheel turns. */
  wheelRate(W) {
    this.wheel.textContent = t("wheel_rate", { rate: (W / 0.03).toFixed(2) });
  }

  make(model, about) {
    this.kind = model.kind;
    $("model").value = model.kind;
    this.sliders = {};
    const made = about.parameters.map((p) => {
      const box = slider(p, model[p.name], t(`p_${p.name}`), (v) => {
        if (p.name === "W") this.wheelRate(v);
        this.page.change({ [p.name]: v });
      });
      this.sliders[p.name] = box;
      return box;
    });
    $("drive").replaceChildren(made[0]);
    this.wheel = null;
    if (model.kind === "disk") {
      this.wheel = document.createElement("p");
      this.wheel.className = "hint";
      $("drive").append(this.wheel);
    }
    $("parameters").replaceChildren(...made.slice(1));
    this.edge = null;
    if (model.kind === "disk") {
      const label = document.createElement("label");
      label.className = "check";
      this.edge = document.createElement("input");
      this.edge.type = "checkbox";
      this.edge.addEventListener("change", () => this.page.change({ edge: this.edge.checked ? "ignore" : "stop" }));
      label.append(this.edge, t("edge"));
      $("parameters").append(label);
    }
    const grid = document.createElement("div");
    grid.className = "numbers-grid";
    this.fields = about.states.map((name) => {
      const [label, field] = labelled(t(`s_${name}`), {});
      grid.append(label);
      return field;
    });
    $("start").replaceChildren(grid);
  }

  /** The start state as typed, or as it is where nothing was typed; null where a field cannot be used. */
  startState() {
    const about = this.page.about(this.kind);
    const state = this.fields.map((field, k) => {
      const value = field.value;
      if (value === undefined) return undefined;
      return field.input.value === field.exact.text ? field.exact.value : value / this.page.scale(about.states[k]);
    });
    return state.includes(undefined) ? null : state;
  }

  /** A drive further by so many steps of its slider, as far as that goes. */
  nudge(steps) {
    const about = this.page.about(this.kind).parameters[0];
    const now = this.page.home.model[about.name];
    const next = +(now + steps * about.step).toPrecision(12);
    const kept = Math.min(Math.max(about.most, now), Math.max(Math.min(about.least, now), next));
    if (kept !== next) this.page.notice(t("slider_ends", { value: shown(kept * about.scale, 2), unit: about.unit }).replace(" .", "."));
    if (kept === now) return;
    this.sliders[about.name].show(kept);
    this.page.change({ [about.name]: kept });
  }

  add(name) {
    $("add-effect").value = "";
    const { effects = [] } = this.page.home.model;
    const spec = this.page.catalogue.effects.find((e) => e.name === name);
    if (!spec || effects.some((e) => e.name === name)) return;
    const made = { name };
    for (const p of spec.parameters) made[p.name] = p.default;
    if (spec.momenta.length) made.momentum = spec.momenta[0];
    if (spec.treatments.length) made.treatment = spec.treatments[0];
    this.page.change({ effects: [...effects, made] });
    this.effects(this.page.home.model);
  }

  effects(model) {
    const key = model.effects.map((e) => e.name).join();
    if (key === this.shown && $("effects").contains(document.activeElement)) return;
    this.shown = key;
    $("effects").replaceChildren(...model.effects.map((effect) => this.effect(effect)));
    if (model.effects.length) $("effects-box").open = true;
  }

  effect(effect) {
    const spec = this.page.catalogue.effects.find((e) => e.name === effect.name);
    const replaced = (change) => this.page.change({
      effects: this.page.home.model.effects.map((e) => (e.name === effect.name ? { ...e, ...change } : e)),
    });
    const box = document.createElement("div");
    box.className = "effect";
    const head = document.createElement("h2");
    const drop = document.createElement("button");
    drop.type = "button";
    drop.textContent = "×";
    drop.setAttribute("aria-label", t("remove_effect", { title: spec.title }));
    drop.addEventListener("click", () => {
      this.page.change({ effects: this.page.home.model.effects.filter((e) => e.name !== effect.name) });
      this.effects(this.page.home.model);
    });
    head.append(spec.title, drop);
    const equation = document.createElement("p");
    equation.textContent = spec.equation;
    equation.title = spec.meaning;
    const grid = document.createElement("div");
    grid.className = "numbers-grid";
    for (const p of spec.parameters) {
      const text = `${p.name}${p.unit ? ` [${p.unit}]` : ""}`;
      const limits = { name: p.name, unit: p.unit, least: p.least, most: p.most };
      const [label, field] = labelled(text, limits, (value) => {
        field.show(String(value));
        replaced({ [p.name]: value });
      });
      field.show(String(effect[p.name]));
      grid.append(label);
    }
    for (const [key, choices] of [["momentum", spec.momenta], ["treatment", spec.treatments]]) {
      if (choices.length < 2) continue;
      const label = document.createElement("label");
      const span = document.createElement("span");
      span.textContent = t(key);
      const select = document.createElement("select");
      select.replaceChildren(...choices.map((c) => new Option(c, c)));
      select.value = effect[key];
      select.addEventListener("change", () => replaced({ [key]: select.value }));
      label.append(span, select);
      grid.append(label);
    }
    box.append(head, equation, grid);
    return box;
  }
}
