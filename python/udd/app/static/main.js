// The page: what is shown, and what happens when something is changed.
import * as url from "./address.js";
import { Diagram } from "./diagram.js";
import { DiskView } from "./disk.js";
import { Energy } from "./energy.js";
import { exporting } from "./export.js";
import { Loop } from "./film.js";
import { listen, tabs } from "./keys.js";
import { Look, recalled, remember } from "./look.js";
import { Link, request } from "./link.js";
import { Panel } from "./panel.js";
import { PhaseView, PlaneView } from "./phase.js";
import { Player } from "./player.js";
import { Sections } from "./sections.js";
import { Series } from "./series.js";
import * as texts from "./texts.js";
import { Tour } from "./tour.js";
import { Trail } from "./trail.js";
import { What } from "./what.js";

const { t } = texts;
const $ = (id) => document.getElementById(id);
const SPEEDS = [0.05, 0.1, 0.25, 0.5, 1, 2, 4, 8];
const BESIDE = 1e-6; // of the second disk: m, or without a unit
const TRAIL = 2400, EVERY = 2; // ten seconds of states, every second one
const SCALES = { Y: 100, Z: 100, J: 1e4 };

class Page {
  constructor(catalogue) {
    this.catalogue = catalogue;
    this.link = new Link((text, stays) => this.notice(text, stays));
    this.player = new Player(this.link);
    this.panel = new Panel(this);
    this.sections = new Sections(this.link, this);
    this.diagram = new Diagram(this.link, this);
    this.energy = new Energy(this);
    this.series = new Series(this);
    this.what = new What(catalogue.effects);
    this.look = new Look();
    this.loop = new Loop(this.link, this);
    this.disk = new DiskView($("disk"), (place, done) => this.drag(place, done));
    this.phase = new PhaseView($("phase"));
    this.plane = new PlaneView($("plane"));
    this.trails = [0, 1].map(() => new Trail(TRAIL / EVERY, 3));
    this.shown = 0; // states of this run that are in the trails
    this.still = matchMedia("(prefers-reduced-motion: reduce)").matches;
    this.stats = { frames: 0, delays: [], ahead: Infinity };
    this.link.on("error", (m) => {
      if (m.of === "page") this.notice(m.text, true);
      else if (m.of !== "run") this.notice(m.text);
      else if (m.generation === this.player.generation) this.player.failed = m.text;
    });
    this.controls();
    if (catalogue.classroom) this.classroom();
    this.fromAddress(true);
    this.tour = new Tour(this.tourSteps());
    addEventListener("hashchange", () => this.fromAddress(false));
    requestAnimationFrame((now) => this.frame(now));
  }

  about(kind) {
    return this.catalogue.models[kind];
  }

  /** By what a coordinate is multiplied for the reader. */
  scale(name) {
    return SCALES[name] ?? 1;
  }

  /** How far the disk's centre can be from the wheels; none without units. */
  get edge() {
    return this.home.model.kind === "disk" ? this.home.model.R : Infinity;
  }

  // --- runs

  /** A run from a state: the trails and the maps begin anew. */
  begin(model, state, { keepTrail = false } = {}) {
    const changed = this.home?.model.kind !== model.kind;
    this.home = { model, state };
    if (changed) {
      this.sections.offer(model.kind);
      this.diagram.offer(model.kind);
      this.series.offer(model.kind);
      this.phase.forget();
      for (const e of document.querySelectorAll(".beyond")) e.hidden = model.kind !== "disk";
    }
    if (!keepTrail) {
      for (const trail of this.trails) trail.clear();
      this.phase.forget();
    }
    this.panel.show(model, state);
    this.run();
  }

  run() {
    const { model, state } = this.home;
    const about = this.about(model.kind);
    const twin = $("twin").checked ? state.map((x, k) => (k === 1 ? x + BESIDE : x)) : null;
    this.shown = 0;
    this.player.start(model, about.columns, this.catalogue.rate, state, twin);
    this.mapsDue = performance.now() + 250;
    clearTimeout(this.writing);
    this.writing = setTimeout(() => this.toAddress(), 150);
  }

  /** Other parameters: the run goes on from the state that is shown. */
  change(values) {
    this.asked = performance.now();
    const model = { ...this.home.model, ...values };
    this.panel.preset("");
    const state = this.player.fresh ? this.home.state : this.shownState();
    this.begin(model, state, { keepTrail: true });
  }

  shownState() {
    if (this.player.fresh || !this.player.records[0]) return this.home.state;
    return this.player.exact(this.about(this.home.model.kind).states.length);
  }

  /** Onto a branch of the diagram. */
  jump(drive, state) {
    const name = this.about(this.home.model.kind).parameters[0].name;
    this.panel.preset("");
    this.begin({ ...this.home.model, [name]: drive }, state);
  }

  /** A fitted model from the loop. */
  open(model, state) {
    this.page($("to-explore"), true);
    this.panel.preset("");
    this.begin(structuredClone(model), state.slice());
  }

  drag([y, z], done) {
    const about = this.about(this.home.model.kind);
    const state = about.states.map((name) => ({ Y: y, y, Z: z, z })[name] ?? (name === "beta" ? this.last?.beta ?? 0 : 0));
    this.dragged = done ? null : { y, z, beta: this.last?.beta ?? 0 };
    if (!done) return;
    this.panel.preset("");
    this.begin(this.home.model, state);
    this.play(true);
  }

  /** What the page shows at each step of the tour. */
  tourSteps() {
    const show = (W, twin, tab, state = [0, 0.001, 0.04, 0]) => () => {
      this.page($("to-explore"));
      this.showMap($(`tab-${tab}`));
      $("twin").checked = twin;
      const { model } = structuredClone(this.catalogue.presets[0]);
      this.panel.preset("");
      this.begin({ ...model, W }, state);
      this.play(true);
      return twin || tab === "what" ? $("figure-disk") : $("maps");
    };
    return [
      show(0, false, "what"),
      show(0.014, false, "energy"),
      show(0.03, false, "section"),
      show(0.03, true, "section"),
      show(0.03, false, "diagram"),
      ...(this.catalogue.classroom ? [] : [() => (this.page($("to-film")), $("sample"))]),
    ];
  }

  // --- the address

  toAddress() {
    const { model, state } = this.home;
    const twin = $("twin").checked;
    history.replaceState(null, "", location.pathname + location.search + url.write({ model, state, twin, tab: this.tab, speed: this.player.speed }, this.catalogue));
  }

  fromAddress(first) {
    let given = null;
    try {
      given = url.read(location.hash, this.catalogue);
      if (given?.changed.length) this.notice(given.changed.join(" "), true);
    } catch (error) {
      this.notice(`${error.message} ${t(first ? "link_instead" : "link_stays", { preset: t(`preset_${this.catalogue.presets[0].key}`) })}`, true);
    }
    if (!given && !first) return;
    const { key, model, state } = this.catalogue.presets[0];
    const start = given ?? { model, state };
    $("twin").checked = Boolean(start.twin);
    if (start.speed) this.setSpeed(start.speed);
    if (start.tab) this.showMap($(`tab-${start.tab}`) ?? $("tab-section"));
    this.panel.preset(given ? "" : key);
    this.begin(structuredClone(start.model), start.state.slice());
  }

  // --- controls

  /** In a class the page only simulates. */
  classroom() {
    for (const id of ["to-film", "export-mp4"]) $(id).hidden = true;
    this.page($("to-explore"));
  }

  controls() {
    $("play").addEventListener("click", () => (this.over ? this.begin(this.home.model, this.home.state) : this.play(!this.player.playing)));
    $("step").addEventListener("click", () => this.step());
    $("restart").addEventListener("click", () => this.begin(this.home.model, this.home.state));
    $("again").addEventListener("click", () => this.begin(this.home.model, this.home.state));
    $("speed").replaceChildren(...SPEEDS.map((s) => new Option(`${s} ×`, s)));
    $("speed").addEventListener("change", () => this.setSpeed(Number($("speed").value)));
    $("twin").addEventListener("change", () => this.begin(this.home.model, this.shownState()));
    $("share").addEventListener("click", () => this.share());
    $("open").addEventListener("click", () => $("open-run").showModal());
    $("open-run").addEventListener("close", () => {
      const text = $("open-link").value.trim();
      if ($("open-run").returnValue !== "open" || !text) return;
      location.hash = text.slice(text.indexOf("#") + 1);
      this.page($("to-explore"), true);
    });
    $("projector").addEventListener("click", () => this.projector());
    $("help").addEventListener("click", () => $("keys").showModal());
    $("key-list").replaceChildren(...texts.list("keys").flatMap(([key, what]) => ["dt", "dd"].map((tag, k) => {
      const e = document.createElement(tag);
      e.textContent = [key, what][k];
      return e;
    })));
    $("language").replaceChildren(...Object.entries(texts.LANGUAGES).map(([code, name]) => new Option(name, code)));
    $("language").value = document.documentElement.lang;
    $("language").addEventListener("change", () => {
      this.begin(this.home.model, this.shownState(), { keepTrail: true });
      this.toAddress(); // the reload goes on from what is shown
      texts.speak($("language").value);
    });
    exporting(this);
    this.showMap = tabs(["section", "diagram", "energy", "series", "what"].map((n) => $(`tab-${n}`)), (id) => {
      this.tab = id.slice(4);
      this.mapsDue = 0;
      if (this.home) this.toAddress();
    });
    this.page = tabs([$("to-explore"), $("to-film")], (id) => remember("page", id));
    this.page($(recalled("page") === "to-film" ? "to-film" : "to-explore"));
    this.showMap($("tab-section"));
    this.setSpeed(1);
    this.play(!this.still);
    $("disk").addEventListener("keydown", (e) => this.arrows(e));
    const drive = (e, by) => this.panel.nudge(by * (e.shiftKey ? 10 : 1));
    listen({
      " ": () => this.play(!this.player.playing),
      ".": () => this.step(),
      r: () => this.begin(this.home.model, this.home.state),
      d: () => $("twin").click(),
      p: () => this.projector(),
      l: () => this.share(),
      e: () => this.page($("to-explore")),
      f: () => this.catalogue.classroom || this.page($("to-film")),
      1: () => this.showMap($("tab-section")),
      2: () => this.showMap($("tab-diagram")),
      3: () => this.showMap($("tab-energy")),
      4: () => this.showMap($("tab-series")),
      5: () => this.showMap($("tab-what")),
      t: () => this.look.dark(),
      "?": () => $("keys").showModal(),
      "+": () => this.faster(1),
      "-": () => this.faster(-1),
      ArrowLeft: (e) => drive(e, -1),
      ArrowRight: (e) => drive(e, 1),
    });
  }

  arrows(e) {
    const by = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[e.key];
    if (!by || !this.last) return;
    e.preventDefault();
    e.stopPropagation();
    const step = this.about(this.home.model.kind).radius / 40;
    this.drag(this.disk.within(this.last.y + by[0] * step, this.last.z + by[1] * step), true);
    this.play(false);
  }

  play(on) {
    this.player.playing = on;
    $("play").textContent = t(on ? "pause" : "play");
  }

  step() {
    this.play(false);
    this.player.advance(4 / this.catalogue.rate / this.player.speed);
  }

  setSpeed(speed) {
    if (!SPEEDS.includes(speed)) this.notice(t("no_speed", { speed, speeds: SPEEDS.join(", ") }));
    this.player.speed = SPEEDS.includes(speed) ? speed : 1;
    $("speed").value = this.player.speed;
    if (this.home) this.toAddress();
  }

  faster(by) {
    const k = SPEEDS.indexOf(this.player.speed) + by;
    if (SPEEDS[k]) this.setSpeed(SPEEDS[k]);
  }

  projector() {
    this.look.projector();
  }

  async share() {
    this.toAddress();
    await this.copy(location.hash, t("shared")); // without the token and the name of this machine
  }

  async copy(text, said) {
    try {
      await navigator.clipboard.writeText(text);
      this.notice(said);
    } catch {
      this.notice(text, true);
    }
  }

  notice(text, stays = false) {
    $("toast").textContent = text;
    clearTimeout(this.hiding);
    if (!stays) this.hiding = setTimeout(() => ($("toast").textContent = ""), 4000);
  }

  // --- frames

  frame(now) {
    requestAnimationFrame((next) => this.frame(next));
    const seconds = Math.min(0.1, (now - (this.before ?? now)) / 1000);
    this.before = now;
    if ($("explore").hidden || !this.home) return;
    const { player } = this;
    if (player.playing && !this.dragged) player.advance(seconds);
    if (!player.fresh && player.records[0]?.count) {
      this.follow();
      this.draw();
      if (this.asked) {
        this.stats.delays.push(performance.now() - this.asked);
        this.asked = null;
      }
      this.stats.frames += 1;
      if (!player.records[0].end && player.playing) this.stats.ahead = Math.min(this.stats.ahead, player.ahead);
    } else if (!player.failed && now - player.since > 1000) $("clock").textContent = t("computing");
    this.end();
    if (now > (this.mapsDue ?? 0)) {
      this.mapsDue = now + 200;
      if (this.tab === "section") this.sections.update();
      if (this.tab === "diagram") this.diagram.update();
    }
    this.drawMaps();
  }

  /** Draw all that is shown, though nothing has changed. */
  redraw() {
    if (!this.player.fresh && this.player.records[0]?.count) this.draw();
    this.sections.dirty = this.diagram.dirty = true;
    this.drawMaps();
  }

  drawMaps() {
    if (this.tab === "section") this.sections.draw();
    if (this.tab === "diagram") this.diagram.draw();
    if (this.tab === "energy") this.energy.draw(this.player);
    if (this.tab === "series") this.series.draw(this.player);
  }

  /** The run in one line: parameters with units, effects, start, time. */
  describe() {
    const { model, state } = this.home;
    const about = this.about(model.kind);
    const number = (v) => String(+v.toPrecision(6)).replace("-", "−");
    const parameters = about.parameters.map((p) => `${p.name} = ${number(model[p.name] * p.scale)} ${p.unit}`.trim());
    const effects = (model.effects ?? []).map(({ name, ...values }) => `${name} (${Object.values(values).join("; ")})`);
    const start = about.states.map((name, k) => `${t(`s_${name}`).replace(/ \[.*/, "")} = ${number(this.scale(name) * state[k])} ${/\[(.*)\]/.exec(t(`s_${name}`))?.[1] ?? ""}`.trim());
    return [...parameters, ...effects, t("picture_start", { state: start.join(", ") }), t("picture_now", { t: $("clock").textContent })].join(", ");
  }

  /** The columns that are drawn: the first of phase space, y, z, beta. */
  get drawn() {
    const names = this.player.columns;
    return this.home.model.kind === "disk" ? ["J", "Y", "Z", "beta"].map((n) => names.indexOf(n)) : ["omega", "y", "z", "beta"].map((n) => names.indexOf(n));
  }

  /** Put the states that were passed into the trails. */
  follow() {
    const { player } = this;
    const now = Math.floor(player.at);
    const columns = this.drawn;
    const first = Math.max(this.shown, now - TRAIL);
    player.records.forEach((record, run) => {
      if (!record) return;
      for (let k = first + (first % EVERY); k <= Math.min(now, record.count - 1); k += EVERY) {
        const row = record.row(k);
        this.trails[run].push([row[columns[0]], row[columns[1]], row[columns[2]]]);
      }
    });
    this.shown = now + 1;
  }

  draw() {
    const { player } = this;
    const { kind } = this.home.model;
    const about = this.about(kind);
    const [, y, z, beta] = this.drawn;
    const rows = player.records.filter(Boolean).map((r) => r.at(player.at, []));
    this.last = { y: rows[0][y], z: rows[0][z], beta: rows[0][beta] };
    const radius = kind === "disk" ? this.home.model.R : about.radius;
    const trails = this.trails.slice(0, rows.length);
    const disks = rows.map((r, k) => [r[y], r[z], r[beta], trails[k]]);
    if (this.dragged) disks[0] = [this.dragged.y, this.dragged.z, this.dragged.beta, null];
    const drive = kind === "disk" ? this.home.model.W : this.home.model.w;
    const time = player.at / about.per_unit;
    this.disk.draw(radius, this.dragged ? disks.slice(0, 1) : disks, drive * time);
    const names = kind === "disk" ? ["J", "Y", "Z"] : ["omega", "y", "z"];
    const units = kind === "disk" ? ["cm²/s", "cm", "cm"] : ["", "", ""];
    this.phase.draw(trails, names.map((n, k) => [n === "omega" ? "ω" : n, units[k], this.scale(n)]));
    this.plane.draw(trails, this.scale(names[1]), radius, [t(`axis_${names[1]}`), t(`axis_${names[2]}`)]);
    if (this.dragged) Object.assign(rows[0], { [y]: this.dragged.y, [z]: this.dragged.z, 0: 0 });
    this.tell(rows, time, about);
    if (this.tab === "what") this.what.draw(this.home.model, rows[0], about);
  }

  tell(rows, time, about) {
    if (performance.now() - (this.told ?? 0) < 100) return;
    this.told = performance.now();
    const { kind } = this.home.model;
    const shown = time.toFixed(2);
    const clock = kind === "disk" ? t("second", { x: shown }) : t("unit_of_time", { x: shown });
    $("clock").textContent = clock;
    const values = { t: clock };
    about.states.forEach((name, k) => (values[name] = (this.scale(name) * rows[0][k]).toFixed(2).replace("-", "−")));
    const text = t(`said_state_${kind}`, values);
    $("numbers").textContent = text.replace(/^[^.]*\. /, "").replace(/^\d+ s\. /, "").replace(/^.*?(Ω|ω)/, "$1");
    if (performance.now() - (this.read ?? 0) > 8000) {
      this.read = performance.now();
      $("said").textContent = text;
    }
    if (rows[1]) {
      const far = Math.hypot(rows[1][this.drawn[1]] - rows[0][this.drawn[1]], rows[1][this.drawn[2]] - rows[0][this.drawn[2]]);
      $("apart").textContent = t(`twin_apart_${kind}`, { apart: small(far) });
    } else $("apart").textContent = "";
  }

  /** Say why a run has ended, and go on where only the record was full. */
  end() {
    const { ended, failed } = this.player;
    if (ended?.outcome === "full") return this.begin(this.home.model, this.shownState(), { keepTrail: true });
    const over = Boolean(ended || failed);
    if (over !== this.over) {
      this.over = over;
      $("play").textContent = t(over ? "again" : this.player.playing ? "pause" : "play");
    }
    $("over").hidden = !over;
    if (failed) $("over-text").textContent = failed;
    if (!ended) return;
    const unit = this.home.model.kind === "disk" ? "second" : "unit_of_time";
    $("over-text").textContent = t(`ended_${ended.outcome}`, { t: t(unit, { x: ended.t.toFixed(2) }) });
  }
}

/** A small number as 2.9 · 10⁻⁶. */
function small(value) {
  const [digits, power] = value.toExponential(1).split("e");
  const raised = [...String(Number(power))].map((d) => (d === "-" ? "⁻" : "⁰¹²³⁴⁵⁶⁷⁸⁹"[d])).join("");
  return `${digits} · 10${raised}`;
}

await texts.load();
try {
  const catalogue = await (await request("/api/catalogue")).json();
  globalThis.udd = new Page(catalogue);
} catch (error) {
  $("toast").textContent = error.message;
  throw error;
}
