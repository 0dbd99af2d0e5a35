// Clicks on frames of a film: contact, two points, marks, edge, region, bob, and frames to leave out.
// The page of a refused film holds this file, and the app loads it: both give the options of `udd track`.
export const WORDS = {
  tools: "Click on the frame",
  pivot: "Contact",
  pivot_swing: "Pivot",
  points: "Two points",
  marks: "Marks",
  edge: "Edge of the disk",
  region: "Region",
  bob: "Bob",
  hint_pivot: "Click the place where the wheels hold the disk.",
  hint_pivot_swing: "Click the place about which the pendulum swings.",
  hint_points: "Click two points of the disk, and give their distance.",
  hint_marks: "Click the middle of each coloured mark, first the one that is above the centre at beta = 0. Then click the edge.",
  hint_edge: "Click three places on the edge, far from each other; or, once, the centre.",
  hint_region: "Click two opposite corners of the part in which it moves.",
  hint_bob: "Click the middle of the bob.",
  hint_bob_two: "Click the middle of the upper bob, then of the lower one.",
  frame: "Frame {index}, {t} s",
  before: "Frame before",
  after: "Frame after",
  omit: "Leave this frame out",
  back: "Take back",
  clear: "Begin again",
  distance: "Distance of the two points [m]",
  leave_out: "Frames to leave out, such as 3,10-20",
  fps: "Frames per second, such as 240 or 30,61:240",
  again: "The command with these clicks",
  copy: "Copy",
  copied: "Copied",
  nothing: "Nothing is clicked yet.",
  need_points: "Click two points and give their distance.",
  need_bob: "Click the lower bob too, in the same frame.",
  need_region: "Click the other corner of the region.",
  need_edge: "Marks need the edge: click three places on it, or the centre.",
  need_marks: "Click two marks or more: the edge alone is of no use.",
  need_fps: "Frames per second must be like 240 or 30,61:240.",
  need_leave_out: "Frames to leave out must be like 3,10-20.",
};
const COLOURS = { pivot: "#00e5ff", points: "#ffd400", marks: "#ff4df0", edge: "#7dff5a", region: "#ff9f1c", bob: "#ff4df0" };
const MOST = { pivot: 1, points: 2, region: 2 };
const ON_DISK = ["points", "marks", "edge"];
const MOVING = [...ON_DISK, "bob"]; // these belong to one frame
const LOUPE = 24; // pixels of the film to each side

const pair = ([u, v], mark) => [u, v].map((x) => +x.toFixed(1)).join(mark);

/** Clicks on the frames of `data`, shown in `box`; `changed` is called after each change. */
export class Clicks {
  constructor(box, data, words = WORDS, changed = () => {}) {
    Object.assign(this, { box, data, words, changed, at: 0, tool: data.tools[0], history: [], most: { ...MOST, bob: data.bobs } });
    const start = data.start ?? {};
    this.places = Object.fromEntries(Object.keys(COLOURS).map((name) => [name, start[name] ?? []]));
    this.frame = start.frame ?? null;
    this.colour = null;
    this.build(start);
    this.show(0);
  }

  make(tag, properties = {}, ...inside) {
    const made = Object.assign(document.createElement(tag), properties);
    made.append(...inside);
    return made;
  }

  build(start) {
    const { words: w, data } = this;
    const radios = data.tools.map((name) => {
      const radio = this.make("input", { type: "radio", name: "clicks-tool", value: name, checked: name === this.tool });
      radio.addEventListener("change", () => this.choose(name));
      return this.make("label", {}, radio, ` ${this.word(name)}`);
    });
    this.hint = this.make("p", { className: "clicks-hint" });
    this.canvas = this.make("canvas", { tabIndex: 0 });
    this.canvas.setAttribute("role", "img");
    const button = (text, act) => {
      const made = this.make("button", { type: "button", textContent: text });
      made.addEventListener("click", act);
      return made;
    };
    this.name = this.make("output");
    this.omit = this.make("input", { type: "checkbox" });
    this.omit.addEventListener("change", () => this.leave(this.omit.checked));
    const field = (name, value = "") => {
      this[name] = this.make("input", { type: "text", value, autocomplete: "off" });
      this[name].dataset.field = name;
      this[name].addEventListener("input", () => this.tell());
      return this.make("label", {}, this.make("span", { textContent: w[name] }), this[name]);
    };
    const fields = [...(data.tools.includes("points") ? [field("distance", start.distance ?? "")] : []),
      field("leave_out", start.leave_out ?? ""), field("fps", start.fps ?? "")];
    this.note = this.make("p", { className: "clicks-note" });
    this.note.setAttribute("aria-live", "polite");
    this.box.replaceChildren(
      this.make("fieldset", {}, this.make("legend", { textContent: w.tools }), ...radios), this.hint, this.canvas,
      this.make("p", { className: "clicks-row" }, button("←", () => this.show(this.at - 1)), this.name,
        button("→", () => this.show(this.at + 1)), this.make("label", {}, this.omit, ` ${w.omit}`),
        button(w.back, () => this.back()), button(w.clear, () => this.clear())),
      this.make("div", { className: "clicks-fields" }, ...fields), this.note,
    );
    const [before, after] = this.box.querySelectorAll(".clicks-row button");
    before.setAttribute("aria-label", w.before);
    after.setAttribute("aria-label", w.after);
    this.canvas.addEventListener("pointerdown", (e) => this.press(e));
    this.canvas.addEventListener("pointermove", (e) => this.drag(e));
    this.canvas.addEventListener("pointerup", () => this.release());
    this.canvas.addEventListener("pointercancel", () => this.release());
    this.canvas.addEventListener("keydown", (e) => this.nudge(e));
    this.choose(this.tool);
  }

  choose(name) {
    this.tool = name;
    this.hint.textContent = this.word(`hint_${name}`);
  }

  /** The word for a tool; some have another one in the film of a pendulum. */
  word(name) {
    const { bobs } = this.data, { words } = this;
    return (bobs > 1 && words[`${name}_two`]) || (bobs && words[`${name}_swing`]) || words[name];
  }

  /** Show the frame with this number in the list. */
  async show(number) {
    const { frames } = this.data;
    this.at = (number + frames.length) % frames.length;
    const { index, t, uri } = frames[this.at];
    const name = this.words.frame.replace("{index}", index).replace("{t}", t.toFixed(2));
    this.name.textContent = `${name} (${this.at + 1}/${frames.length})`;
    this.canvas.setAttribute("aria-label", name);
    const image = new Image();
    image.src = uri;
    await image.decode();
    if (uri !== frames[this.at].uri) return;
    this.image = image;
    this.canvas.width = image.naturalWidth;
    this.canvas.height = image.naturalHeight;
    const { width, height } = this.canvas;
    this.canvas.style.width = `min(100%, ${Math.max(480, width)}px, ${(70 * width) / height}vh)`;
    this.tell();
  }

  /** Pixels of the shown picture to a pixel of the film. */
  get zoom() {
    return this.canvas.width / this.data.size[0];
  }

  place(e) {
    const box = this.canvas.getBoundingClientRect();
    const [width, height] = this.data.size;
    const within = (x, most) => Math.min(Math.max(x, 0), most - 1);
    return [within(((e.clientX - box.left) / box.width) * width - 0.5, width),
      within(((e.clientY - box.top) / box.height) * height - 0.5, height)];
  }

  remember() {
    const { index } = this.data.frames[this.at];
    this.history.push(JSON.stringify([this.places, this.frame, this.colour]));
    if (!MOVING.includes(this.tool)) return;
    if (this.frame !== index) for (const name of MOVING) this.places[name] = [];
    this.frame = index;
  }

  press(e) {
    if (!this.image || e.button) return;
    e.preventDefault();
    this.canvas.focus({ preventScroll: true });
    try {
      this.canvas.setPointerCapture(e.pointerId);
    } catch {} // the pointer is gone already
    this.remember();
    const list = this.places[this.tool];
    const most = this.most[this.tool] ?? 64;
    if (list.length >= most) list.length = most === 2 ? 0 : most - 1;
    list.push(this.place(e));
    this.held = true;
    this.tell();
  }

  drag(e) {
    if (!this.held) return;
    this.places[this.tool][this.places[this.tool].length - 1] = this.place(e);
    this.draw();
  }

  release() {
    this.held = false;
    this.tell();
  }

  /** Arrow keys move the last point by half a pixel. */
  nudge(e) {
    const way = { ArrowLeft: [-0.5, 0], ArrowRight: [0.5, 0], ArrowUp: [0, -0.5], ArrowDown: [0, 0.5] }[e.key];
    const last = this.places[this.tool].at(-1);
    if (!way || !last) return;
    e.preventDefault();
    last[0] += way[0];
    last[1] += way[1];
    this.tell();
  }

  back() {
    if (this.history.length) [this.places, this.frame, this.colour] = JSON.parse(this.history.pop());
    this.tell();
  }

  clear() {
    this.history.push(JSON.stringify([this.places, this.frame, this.colour]));
    for (const name of Object.keys(this.places)) this.places[name] = [];
    this.frame = this.colour = null;
    this.tell();
  }

  /** Leave the shown frame out, or take it in again. */
  leave(out) {
    const { index } = this.data.frames[this.at], parts = this.leave_out.value.split(",").filter((x) => x.trim());
    this.leave_out.value = (out ? [...parts, index] : parts.filter((x) => x.trim() !== String(index))).join(",");
    this.tell();
  }

  tell() {
    if (!this.image) return;
    const { index } = this.data.frames[this.at];
    this.omit.checked = this.leave_out.value.split(",").some((part) => {
      const [first, last] = part.split("-");
      return part.trim() && index >= +first && index <= +(last ?? first);
    });
    if (this.places.bob.length && this.frame === index && !this.held) this.sample();
    this.draw();
    const { problem, empty } = this;
    this.note.textContent = problem || (empty ? this.words.nothing : "");
    this.changed(this);
  }

  /** The colours of the bobs: medians of 5 x 5 pixels. */
  sample() {
    const bare = document.createElement("canvas");
    bare.width = this.canvas.width;
    bare.height = this.canvas.height;
    const c = bare.getContext("2d", { willReadFrequently: true });
    c.drawImage(this.image, 0, 0);
    this.colour = this.places.bob.map(([u, v]) => {
      const { data } = c.getImageData(Math.round(u * this.zoom) - 2, Math.round(v * this.zoom) - 2, 5, 5);
      return [0, 1, 2].map((k) => Array.from({ length: 25 }, (_, n) => data[4 * n + k]).sort((a, b) => a - b)[12]);
    });
  }

  get rates() {
    const parts = this.fps.value.split(",").map((part) => part.split(":").map((x) => (x.trim() ? +x : NaN)));
    return this.fps.value.trim() ? parts.map((part) => (part.length > 1 ? part : [0, part[0]])) : [];
  }

  get stretches() {
    const text = this.leave_out.value.trim();
    return text ? text.split(",").map((part) => part.trim().split("-").map((x) => (/^\d+$/.test(x) ? +x : NaN))) : [];
  }

  get empty() {
    return !Object.values(this.places).some((list) => list.length) && !this.fps.value.trim() && !this.leave_out.value.trim();
  }

  /** What is missing, in a sentence; "" if nothing. */
  get problem() {
    const { places: p, words: w } = this, metres = this.distance ? +this.distance.value.replace(",", ".") : 0;
    if (this.distance && (p.points.length || this.distance.value.trim()) && !(p.points.length === 2 && metres > 0)) return w.need_points;
    if (p.bob.length && p.bob.length < this.data.bobs) return w.need_bob;
    if (p.region.length === 1) return w.need_region;
    if (p.marks.length && ![1, 3].includes(Math.min(p.edge.length, 3))) return w.need_edge;
    if (p.edge.length && p.marks.length < 2) return w.need_marks;
    const { rates, stretches } = this;
    const whole = (part, k) => part.length <= 2 && part.every((x) => x >= 0) && part.at(-1) > 0 && (k ? part[0] > rates[k - 1][0] : part[0] === 0);
    if (!rates.every(whole)) return w.need_fps;
    return stretches.every((part) => part.length <= 2 && part[0] <= part.at(-1)) ? "" : w.need_leave_out;
  }

  /** The options of `udd.track`, as JSON has them. */
  get value() {
    const { places: p, rates, stretches } = this, round = ([u, v]) => [+u.toFixed(1), +v.toFixed(1)], out = {};
    const clicks = {};
    if (p.pivot.length && this.data.bobs) out.pivot = round(p.pivot[0]);
    else if (p.pivot.length) clicks.pivot = round(p.pivot[0]);
    for (const name of ON_DISK) if (p[name].length) clicks[name] = p[name].map(round);
    if (p.points.length) clicks.distance = +this.distance.value.replace(",", ".");
    if (Object.keys(clicks).length) out.clicks = { frame: this.frame ?? this.data.frames[this.at].index, ...clicks };
    if (p.region.length) {
      const sorted = [0, 1].map((k) => p.region.map((place) => Math.round(place[k])).sort((a, b) => a - b));
      out.region = [sorted[0][0], sorted[1][0], sorted[0][1], sorted[1][1]];
    }
    if (rates.length) out.fps = rates.length > 1 ? rates : rates[0][1];
    if (stretches.length) out.leave_out = stretches.map((part) => [part[0], part.at(-1)]);
    if (this.colour) out.bob = this.colour.join();
    return out;
  }

  /** The command line that tracks the film again. */
  get command() {
    const { value } = this, { clicks } = value, words = [this.data.command];
    if (clicks) {
      const parts = [`frame=${clicks.frame}`];
      if (clicks.pivot) parts.push(`pivot=${pair(clicks.pivot, ":")}`);
      for (const [name, singular] of [["marks", "mark"], ["edge", "edge"], ["points", "point"]]) {
        parts.push(...(clicks[name] ?? []).map((place) => `${singular}=${pair(place, ":")}`));
      }
      if (clicks.distance) parts.push(`distance=${clicks.distance}`);
      words.push("--clicks", parts.join(","));
    }
    if (value.pivot) words.push("--pivot", value.pivot.join(","));
    if (value.bob) words.push("--bob", value.bob);
    if (value.region) words.push("--region", value.region.join(","));
    if (value.fps) words.push("--fps", Array.isArray(value.fps) ? value.fps.map(([k, rate], n) => (n ? `${k}:${rate}` : rate)).join(",") : value.fps);
    if (value.leave_out) words.push("--leave-out", value.leave_out.map(([a, b]) => (a === b ? a : `${a}-${b}`)).join(","));
    return words.join(" ");
  }

  draw() {
    const c = this.canvas.getContext("2d"), { zoom } = this;
    const fine = Math.max(1, this.canvas.width / (this.canvas.clientWidth || this.canvas.width));
    const frame = this.data.frames[this.at];
    c.drawImage(this.image, 0, 0);
    const at = ([u, v]) => [(u + 0.5) * zoom, (v + 0.5) * zoom];
    const stroke = (colour, path) => {
      for (const [style, width] of [["#000", 4], [colour, 2]]) {
        c.strokeStyle = style;
        c.lineWidth = width * fine;
        c.beginPath();
        path();
        c.stroke();
      }
    };
    for (const [name, list] of Object.entries(this.places)) {
      if (MOVING.includes(name) && this.frame !== frame.index) continue;
      const dots = list.map(at), size = 9 * fine;
      if (name === "region" && dots.length === 2) stroke(COLOURS.region, () => c.rect(...dots[0], dots[1][0] - dots[0][0], dots[1][1] - dots[0][1]));
      if (name === "points" && dots.length === 2) stroke(COLOURS.points, () => dots.forEach((dot, k) => c[k ? "lineTo" : "moveTo"](...dot)));
      dots.forEach(([x, y], k) => {
        stroke(COLOURS[name], () => {
          c.moveTo(x - size, y);
          c.lineTo(x + size, y);
          c.moveTo(x, y - size);
          c.lineTo(x, y + size);
        });
        if (name !== "marks") return;
        c.font = `bold ${14 * fine}px sans-serif`;
        c.lineWidth = 3 * fine;
        c.strokeText(k + 1, x + 0.6 * size, y - 0.6 * size);
        c.fillStyle = "#fff";
        c.fillText(k + 1, x + 0.6 * size, y - 0.6 * size);
      });
    }
    if (this.held) this.loupe(c, fine);
  }

  /** Enlarge what is about the last point, in the corner away from it. */
  loupe(c, fine) {
    const [u, v] = this.places[this.tool].at(-1), { zoom } = this, { width, height } = this.canvas;
    const side = Math.min(0.35 * width, 0.35 * height, 150 * fine), far = LOUPE * zoom;
    const x = (u + 0.5) * zoom < width / 2 ? width - side : 0, y = (v + 0.5) * zoom < height / 2 ? height - side : 0;
    c.imageSmoothingEnabled = false;
    c.fillStyle = "#000";
    c.fillRect(x, y, side, side);
    c.drawImage(this.image, (u + 0.5) * zoom - far, (v + 0.5) * zoom - far, 2 * far, 2 * far, x, y, side, side);
    c.strokeStyle = COLOURS[this.tool];
    c.lineWidth = fine;
    c.strokeRect(x, y, side, side);
    c.beginPath();
    c.moveTo(x + side / 2, y);
    c.lineTo(x + side / 2, y + side);
    c.moveTo(x, y + side / 2);
    c.lineTo(x + side, y + side / 2);
    c.stroke();
  }
}

/** On a page alone: the clicks, the command below them, and a button that copies it. */
export function standAlone(box, data) {
  const inside = document.createElement("div"), code = document.createElement("code"), pre = document.createElement("pre");
  const copy = document.createElement("button"), heading = document.createElement("h3");
  heading.textContent = WORDS.again;
  copy.type = "button";
  copy.textContent = WORDS.copy;
  pre.append(code);
  box.append(inside, heading, pre, copy);
  const clicks = new Clicks(inside, data, WORDS, ({ command, problem, empty }) => {
    code.textContent = command;
    copy.disabled = Boolean(problem) || empty;
    copy.textContent = WORDS.copy;
  });
  copy.addEventListener("click", async () => {
    try {
      await navigator.clipboard.writeText(code.textContent);
    } catch {
      getSelection().selectAllChildren(code);
      document.execCommand("copy");
    }
    copy.textContent = WORDS.copied;
  });
  return clicks;
}
