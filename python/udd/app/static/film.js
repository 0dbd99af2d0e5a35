// The loop: a film or a table goes in, the verdict comes out.
import { Clicks, WORDS } from "./clicks.js";
import { Columns } from "./columns.js";
import { address, request } from "./link.js";
import { recalled, remember } from "./look.js";
import { NumberField } from "./numbers.js";
import { explain, term } from "./terms.js";
import { list, t } from "./texts.js";

const $ = (id) => document.getElementById(id);
const FILMS = /\.(mp4|mov|m4v|avi|mkv|webm|mpg|mpeg|wmv|mts|m2ts|ts|3gp|ogv|flv|h264|dv)$/i;
const REFUSED = "refused.json";
const MARKS = ["#e41a1c", "#ff9f1c", "#2b6cff", "#1fae4b"];

export class Loop {
  constructor(link, page) {
    this.link = link;
    this.page = page;
    this.job = null;
    this.fields = Object.fromEntries(["W", "R", "length", "wheel", "rpm"].map((name) => {
      const key = { wheel: "loop_wheel_R", rpm: "loop_rpm" }[name] ?? `loop_${name}`;
      return [name, new NumberField($(`loop-${name}`), { name: t(key), least: 0, most: null, optional: true }, () => this.tell())];
    }));
    for (const name of ["begin", "end"]) {
      const about = { name: t(`loop_${name}`), least: null, most: null, optional: true };
      this.fields[name] = new NumberField($(`loop-${name}`), about, () => this.tell());
    }
    for (const name of ["W", "R", "length"]) $(`loop-${name}`).addEventListener("input", () => this.tell());
    for (const name of ["wheel", "rpm"]) $(`loop-${name}`).addEventListener("input", () => this.fromWheel());
    this.columns = new Columns(() => this.tell());
    const colours = list("loop_bobs");
    const bobs = colours.map(([value, colour]) => new Option(t("loop_pendulum", { colour }), value));
    $("loop-bob").append(new Option(t("loop_disk"), ""), ...bobs);
    $("loop-lower").append(new Option(t("loop_no_lower"), ""), ...colours.map(([value, colour]) => new Option(colour, value)));
    for (const id of ["loop-bob", "loop-lower"]) $(id).addEventListener("change", () => this.tell());
    $("file").addEventListener("change", () => this.choose($("file").files[0]));
    $("go").addEventListener("click", () => this.send());
    $("track-again").addEventListener("click", () => this.again());
    $("sample").addEventListener("click", () => this.begin("sample"));
    $("cancel").addEventListener("click", () => this.cancel());
    $("another").addEventListener("click", () => {
      remember("job", "");
      this.show("ask");
    });
    $("explore-fit").addEventListener("click", () => page.open(this.fitted.model, this.fitted.state));
    const drop = $("drop");
    for (const name of ["dragover", "dragenter"]) {
      drop.addEventListener(name, (e) => {
        e.preventDefault();
        drop.classList.add("over");
      });
    }
    drop.addEventListener("dragleave", () => drop.classList.remove("over"));
    drop.addEventListener("drop", (e) => {
      e.preventDefault();
      drop.classList.remove("over");
      this.choose(e.dataTransfer.files[0]);
    });
    link.on("job", (message) => message.job === this.job && this.take(message));
    link.on("error", (message) => message.of === "watch" && this.forget());
    link.on("frame", ({ numbers: [length], body }) => this.frame(length, body));
    link.on("open", () => this.job && link.say({ type: "watch", job: this.job }));
    this.show("ask");
    this.tell();
    this.job = recalled("job"); // a job that ran when the page was reloaded
  }

  show(name) {
    for (const id of ["ask", "work", "found"]) $(id).hidden = id !== name;
    if (name !== "found") $("report").removeAttribute("src");
  }

  /** The job is not there any more: the server was started anew. */
  forget() {
    this.job = null;
    remember("job", "");
  }

  async choose(file) {
    this.file = file ?? null;
    this.table = null;
    this.fail("");
    this.columns.hide();
    $("bob-box").hidden = !this.isFilm;
    $("chosen").textContent = file ? t("loop_chosen", { name: file.name, size: (file.size / 2 ** 20).toFixed(1) }) : "";
    if (file && this.tooLarge) this.fail(t("loop_too_large", { size: this.page.catalogue.limits.upload >> 20 }));
    this.tell();
    if (!file || this.isFilm || this.tooLarge) return;
    this.reading = true;
    this.tell();
    try {
      const answer = await request("/api/table", {}, { method: "POST", body: file });
      const found = await answer.json();
      if (file !== this.file) return;
      this.table = found;
      this.columns.show(found);
      this.fields.begin.show(found.begin === null ? "" : String(found.begin));
      this.fields.end.show("");
      $("begin-said").textContent = found.begin === null ? "" : t("loop_begin_said", { t: found.begin });
    } catch (error) {
      if (file === this.file) this.fail(error.message);
    }
    this.reading = false;
    this.tell();
  }

  get isFilm() {
    return this.file?.type.startsWith("video/") || FILMS.test(this.file?.name ?? "");
  }

  /** The colour of the bob if the film shows a pendulum; of both bobs if it is a double one. */
  get bob() {
    return this.isFilm ? ["loop-bob", "loop-lower"].map((id) => $(id).value).filter(Boolean).join() : "";
  }

  get tooLarge() {
    return this.file && this.file.size > this.page.catalogue.limits.upload;
  }

  /** The drive speed by the wheel's radius and its turns per minute. */
  fromWheel() {
    const { wheel, rpm } = this.fields;
    if (!wheel.wrong && !rpm.wrong && this.said("wheel") && this.said("rpm")) {
      this.fields.W.show(String(+((2 * Math.PI * wheel.value * rpm.value) / 60).toPrecision(4)));
    }
    this.tell();
  }

  /** Why the file cannot be sent yet; "" if it can. */
  get why() {
    if (!this.file) return t("why_file");
    if (this.tooLarge) return t("why_large");
    if (Object.values(this.fields).some((field) => field.wrong)) return t("why_number");
    if (this.bob) return this.said("length") ? "" : t("why_length");
    if (this.isFilm) return this.said("W") ? "" : t("why_W");
    if (this.reading) return t("why_reading");
    if (!this.table) return "";
    const kind = this.columns.kind;
    if (!kind) return t("why_columns");
    if (this.columns.unitMissing) return t("why_unit");
    if (kind === "disk") return this.columns.driven || this.said("W") || this.table.meta.W !== null ? "" : t("why_W");
    return this.said("length") || this.table.meta.length !== null ? "" : t("why_length");
  }

  /** What seems to be in metres instead of centimetres; "" if nothing. */
  get doubt() {
    const least = { W: 0.2, R: 0.5, length: 2 };
    const name = Object.keys(least).find((key) => {
      const { value } = this.fields[key];
      return value > 0 && value < least[key];
    });
    return name ? t("doubt_metres", { name: t(`loop_${name}`).replace(/ \[.*/, ""), value: this.fields[name].value }) : "";
  }

  said(name) {
    return this.fields[name].input.value.trim() !== "";
  }

  /** Say beside the button what is missing. */
  tell() {
    const { why } = this, disk = !$("loop-bob").value;
    $("loop-layout").parentElement.hidden = !disk;
    $("loop-lower").parentElement.hidden = disk;
    if (disk) $("loop-lower").value = "";
    $("why").textContent = why || this.doubt;
    $("go").classList.toggle("waiting", why !== "");
  }

  async send() {
    const values = {};
    for (const name of ["W", "R", "length"]) {
      const { value } = this.fields[name];
      if (value === undefined) return this.tell();
      if (value !== null) values[name] = String(+(value / 100).toPrecision(12));
    }
    if (this.why) return this.fail(this.tooLarge ? t("loop_too_large", { size: this.page.catalogue.limits.upload >> 20 }) : this.why);
    for (const name of this.table ? ["begin", "end"] : []) {
      const { value } = this.fields[name];
      if (value === undefined) return this.tell();
      if (value !== null) values[name] = String(value);
    }
    const chosen = this.isFilm || !this.table ? [] : this.columns.chosen;
    if (this.bob) values.bob = this.bob;
    else if (this.isFilm && $("loop-layout").files[0]) values.config = await $("loop-layout").files[0].slice(0, 16384).text(); // a film by mistake
    if (chosen.length) values.columns = JSON.stringify(chosen);
    await this.begin("film", values, this.file);
  }

  async begin(kind, values = {}, body = undefined) {
    this.fail("");
    this.stages([t(kind === "film" ? "loop_uploading" : "loop_starting")]);
    const canvas = $("frames");
    canvas.getContext("2d").clearRect(0, 0, canvas.width, canvas.height);
    canvas.parentElement.hidden = true;
    $("progress").removeAttribute("value");
    this.job = null;
    this.show("work");
    try {
      const answer = await request(`/api/jobs/${kind}`, values, { method: "POST", body });
      this.job = (await answer.json()).job;
      remember("job", this.job);
      this.link.say({ type: "watch", job: this.job });
    } catch (error) {
      this.fail(error.message);
    }
  }

  cancel() {
    if (this.job) this.link.say({ type: "cancel", job: this.job });
    else this.show("ask");
  }

  fail(text, parts = []) {
    if (text) remember("job", "");
    this.show("ask");
    $("failed").textContent = text;
    const kept = parts.filter(({ name }) => name !== REFUSED);
    $("kept").hidden = !kept.length;
    $("kept").replaceChildren(...(kept.length ? [t("loop_kept"), ...kept.map((part) => this.linkTo(part))] : []));
    $("refused").hidden = true;
    if (kept.length < parts.length) this.offerClicks();
  }

  /** Show frames of a refused film, to click what is known of it. */
  async offerClicks() {
    const { job } = this, answer = await request(`/api/jobs/${job}/${REFUSED}`), data = await answer.json();
    if (job !== this.job || !$("failed").textContent) return;
    const words = Object.fromEntries(Object.keys(WORDS).map((name) => [name, t(`clicks_${name}`)]));
    $("refused").hidden = false;
    $("failed").scrollIntoView();
    this.clicks = new Clicks(document.querySelector("#refused .clicks"), data, words, ({ problem, empty }) => {
      $("track-again").disabled = Boolean(problem) || empty;
    });
  }

  async again() {
    await this.begin("again", { of: this.job }, JSON.stringify(this.clicks.value));
  }

  linkTo({ name, title }) {
    const a = document.createElement("a");
    a.href = this.part(name, { download: "1" });
    a.download = `udd-${name}`;
    a.textContent = title;
    return a;
  }

  stages(list) {
    const items = list.map((text) => {
      const item = document.createElement("li");
      item.textContent = text;
      return item;
    });
    $("stages").replaceChildren(...items);
    $("stages").scrollTop = 1e6;
  }

  take({ state, stages, answer }) {
    if (state === "waiting" || state === "running") this.show("work");
    if (state === "waiting") this.stages([t("loop_waiting")]);
    else this.stages(stages);
    if (stages.length && !stages.at(-1).includes("film")) $("progress").removeAttribute("value");
    if (state === "cancelled") this.fail(t("loop_cancelled"));
    if (state === "failed") this.fail(answer.error, answer.parts);
    if (state === "done") this.done(answer);
  }

  async frame(length, body) {
    const about = JSON.parse(new TextDecoder().decode(body.subarray(0, length)));
    if (about.job !== this.job) return;
    const picture = await createImageBitmap(new Blob([body.subarray(length)], { type: "image/jpeg" }));
    const canvas = $("frames"), c = canvas.getContext("2d");
    canvas.parentElement.hidden = false;
    if (canvas.width !== picture.width || canvas.height !== picture.height) {
      canvas.width = picture.width;
      canvas.height = picture.height;
    }
    c.drawImage(picture, 0, 0);
    c.lineWidth = 2.5;
    for (const [k, [u, v]] of (about.marks ?? []).entries()) {
      for (const [colour, radius] of [["#fff", 11], [MARKS[k], 9]]) {
        c.strokeStyle = colour;
        c.beginPath();
        c.arc(u, v, radius, 0, 2 * Math.PI);
        c.stroke();
      }
    }
    if (about.centre) {
      const [u, v] = about.centre;
      c.strokeStyle = "#00b7cf";
      c.beginPath();
      c.moveTo(u - 8, v);
      c.lineTo(u + 8, v);
      c.moveTo(u, v - 8);
      c.lineTo(u, v + 8);
      c.stroke();
    }
    $("progress").value = about.number / about.of;
    $("frame-said").textContent = t(about.marks ? "loop_frame" : "loop_frame_lost", about);
  }

  part(name, more = {}) {
    return address(`/api/jobs/${this.job}/${name}`, more);
  }

  done(found) {
    this.show("found");
    this.fitted = found.explore;
    $("explore-fit").hidden = !found.explore;
    const verdict = new Map(list("verdicts")).get(found.verdict);
    const meaning = new Map(list("terms")).get(found.verdict);
    $("verdict").replaceChildren(meaning ? term(verdict, meaning) : verdict);
    $("verdict-language").textContent = t("loop_english");
    $("sentence").textContent = found.sentence;
    $("added").replaceChildren(...found.effects.map((e) => {
      const p = document.createElement("p");
      p.className = "formula";
      const b = document.createElement("b");
      b.textContent = e.equation;
      p.append(`${e.title}: `, b);
      if (e.values.length) p.append(" ", term(t("loop_with", { values: e.values.join(", ") }), t("loop_brackets")));
      return p;
    }), ...[...found.limits, ...(found.warnings ?? [])].map((text) => {
      const p = document.createElement("p");
      p.textContent = text;
      return p;
    }));
    const range = (text) => text.replace(" to ", ` ${t("loop_to")} `);
    const after = found.horizon === null ? t("loop_whole") : t("loop_horizon_after", { t: +found.horizon.toPrecision(3) });
    const span = found.of_spread ? `${t("loop_of_spread")}, ${after}` : after;
    const note = (k) => (found.no_more_than_noise[k] ? `${span}; ${t("loop_no_more")}` : span);
    const figures = [[found.no_more_than_noise[0] ? "" : "before", t("loop_before"), found.before, note(0)]];
    if (found.after) {
      figures.push(["after", t("loop_after"), found.after, note(1)]);
      figures.push(["", t("loop_ratio"), found.ratio, t("loop_interval", { interval: range(found.interval) })]);
    }
    figures.push(["", t("loop_floor"), found.floor, span]);
    $("figures").replaceChildren(...figures.map(([kind, name, value, small]) => {
      const box = document.createElement("div");
      box.className = kind;
      for (const [tag, text] of [["dt", name], ["dd", value]]) {
        const e = document.createElement(tag);
        e.textContent = text;
        box.append(e);
      }
      const remark = document.createElement("small");
      remark.textContent = small;
      box.lastChild.append(remark);
      return box;
    }));
    this.movie(found.parts, found.effects.length > 0);
    const constants = found.constants.map((c) => [c.name, c.meaning, `${c.value} ${c.unit}`.trim()]);
    const columns = [t("loop_constant"), t("loop_meaning"), t("loop_value")];
    $("constants").replaceChildren(table(t("loop_constants"), columns, constants));
    explain($("constants"), [[t("loop_value"), t("loop_brackets")]]);
    $("constants").hidden = !constants.length;
    const errors = found.errors.map((e) => [e.horizon, e.before, ...(found.after ? [e.after] : []), e.floor].map(range));
    const heads = [t("loop_horizon"), t("loop_before"), ...(found.after ? [t("loop_after")] : []), t("loop_floor")];
    $("errors").replaceChildren(table(t("loop_errors"), heads, errors));
    const evidence = found.evidence.map((e) => [e.title, e.chi2 === null ? "–" : e.chi2.toFixed(1)]);
    $("evidence").replaceChildren(table(t("loop_evidence"), [t("loop_candidate"), t("loop_chi2")], evidence));
    $("files").replaceChildren(...found.parts.map(({ name, title }) => {
      const item = document.createElement("li");
      item.append(this.linkTo({ name, title }));
      return item;
    }));
    $("report").src = this.part("report.html");
    for (const id of ["sentence", "added", "figures", "evidence", "errors"]) explain($(id), list("terms"));
  }

  movie(parts, more) {
    const part = parts.find(({ name }) => /^picture-\d+\.(mp4)$/.test(name)) ?? parts.find(({ name }) => name === "picture-1.svg");
    $("movie").replaceChildren();
    if (!part) return;
    const film = part.name.endsWith("mp4");
    const shown = document.createElement(film ? "video" : "img");
    shown.src = this.part(part.name);
    if (film) {
      Object.assign(shown, { controls: true, loop: true, muted: true, autoplay: !matchMedia("(prefers-reduced-motion: reduce)").matches });
      shown.setAttribute("aria-label", part.title);
    } else shown.alt = part.title;
    $("movie").append(shown);
    if (!film) return; // a picture has its own legend
    const titles = document.createElement("div");
    titles.className = "panels";
    titles.append(...[t("loop_measured"), t("loop_known"), ...(more ? [t("loop_after")] : [])].map((text) => {
      const title = document.createElement("span");
      title.textContent = text;
      return title;
    }));
    $("movie").prepend(titles);
  }
}

function table(caption, heads, rows) {
  const made = document.createElement("table");
  made.createCaption().textContent = caption;
  const head = made.createTHead().insertRow();
  for (const text of heads) {
    const th = document.createElement("th");
    th.scope = "col";
    th.textContent = text;
    head.append(th);
  }
  const body = made.createTBody();
  for (const row of rows) {
    const tr = body.insertRow();
    for (const text of row) tr.insertCell().textContent = text;
  }
  return made;
}
