// The controls: model, drive, parameters, effects, start state.
import { t } from "./texts.js";

const $ = (id) => document.getElementById(id);

/** A slider with a number beside it; `changed` is told the value in the model's unit. */
function slider(about, value, label, changed) {
  const box = document.createElement("div");
  box.className = "slider";
  const id = `p-${about.name}`;
  const digits = Math.max(0, -Math.floor(Math.log10(about.step * about.scale) + 1e-9));
  box.innerHTML = `<div class="row"><label for="${id}"></label><input type="number"><span class="unit"></span></div><input type="range">`;
  const [number, range] = box.querySelectorAll("input");
  box.querySelector("label").textContent = label;
  box.querySelector(".unit").textContent = about.unit;
  range.id = id;
  number.setAttribute("aria-label", `${label}${about.unit ? ` [${about.unit}]` : ""}`);
  for (const [key, v] of [["min", about.least], ["max", about.most], ["step", about.step]]) {
    range[key] = v;
    number[key] = +(v * about.scale).toPrecision(12);
  }
  const show = (v) => {
    range.value = v;
    number.value = (v * about.scale).toFixed(digits);
    range.setAttribute("aria-valuetext", `${number.value} ${about.unit}`);
  };
  range.addEventListener("input", () => {
    const v = Number(range.value);
    number.value = (v * about.scale).toFixed(digits);
    range.setAttribute("aria-valuetext", `${number.value} ${about.unit}`);
    changed(v);
  });
  number.addEventListener("change", () => {
    const v = +(Number(number.value) / about.scale).toPrecision(12);
    if (number.value.trim() === "" || !Number.isFinite(v)) return;
    const kept = Math.min(about.most, Math.max(about.least === 0.001 || about.least === 0.05 ? 0 : about.least, v));
    if (kept !== v) number.value = (kept * about.scale).toFixed(digits);
    range.value = kept;
    changed(kept);
  });
  show(value);
  box.show = show;
  box.range = range;
  return box;
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
    $("start-here").addEventListener("click", () => page.begin(page.home.model, this.startState()));
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
    for (const [k, input] of [...$("start").querySelectorAll("input")].entries()) {
      input.value = +(state[k] * this.page.scale(about.states[k])).toPrecision(8);
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
    for (const name of about.states) {
      const label = document.createElement("label");
      const span = document.createElement("span");
      span.textContent = t(`s_${name}`);
      const input = document.createElement("input");
      input.type = "number";
      input.step = "any";
      label.append(span, input);
      grid.append(label);
    }
    $("start").replaceChildren(grid);
  }

  startState() {
    const about = this.page.about(this.kind);
    return [...$("start").querySelectorAll("input")].map((input, k) => Number(input.value) / this.page.scale(about.states[k]));
  }

  /** A drive further by so many steps of its slider. */
  nudge(steps) {
    const about = this.page.about(this.kind).parameters[0];
    const now = this.page.home.model[about.name] + steps * about.step;
    const kept = +Math.min(about.most, Math.max(about.least, now)).toPrecision(12);
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
    const head = document.createElement("h4");
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
      const label = document.createElement("label");
      const span = document.createElement("span");
      span.textContent = `${p.name}${p.unit ? ` [${p.unit}]` : ""}`;
      const input = document.createElement("input");
      input.type = "number";
      input.step = "any";
      input.value = effect[p.name];
      input.addEventListener("change", () => input.value.trim() && replaced({ [p.name]: Number(input.value) }));
      label.append(span, input);
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
