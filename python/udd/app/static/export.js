// What can be taken away: table, picture, film, Python.
import { python } from "./address.js";
import { address, request } from "./link.js";
import { GROUND, INK, sharpen, SOFT } from "./plot.js";
import { t } from "./texts.js";

const $ = (id) => document.getElementById(id);

export function exporting(page) {
  const run = () => JSON.stringify(page.home);
  const acts = {
    csv: () => table(page, run(), { units: "shown" }),
    exact: () => table(page, run()),
    png: () => picture(page).toBlob((blob) => save(URL.createObjectURL(blob), "udd.png")),
    mp4: () => film(page, run()),
    python: () => page.copy(python(page.home, page.catalogue), t("copied_python")),
  };
  for (const [name, act] of Object.entries(acts)) {
    $(`export-${name}`).addEventListener("click", () => {
      $("export").open = false;
      act();
    });
  }
  document.addEventListener("click", (e) => $("export").contains(e.target) || ($("export").open = false));
  $("export").addEventListener("keydown", (e) => e.key === "Escape" && ($("export").open = false));
}

/** How long the run is that was shown so far, s on the clock of the wall. */
function seconds(page, least) {
  return Math.max(least, Math.floor(page.player.at) / page.catalogue.rate);
}

function save(href, name) {
  const a = document.createElement("a");
  a.href = href;
  a.download = name;
  a.click();
}

function table(page, run, more = {}) {
  save(address("/api/run.csv", { run, seconds: String(seconds(page, 1)), ...more }), "udd-run.csv");
}

/** All pictures that are shown, as on the page but at least twice as sharp, with their titles and the run's parameters. */
function picture(page) {
  const ratio = Math.max(2, window.devicePixelRatio || 1);
  const size = parseFloat(getComputedStyle(document.body).fontSize);
  const shown = [...$("explore").querySelectorAll("canvas")].filter((c) => c.offsetParent && c.width);
  const titles = [...$("explore").querySelectorAll("figcaption, #maps [aria-selected=true]")].filter((e) => e.offsetParent);
  const place = (e) => {
    const { left, right, top, bottom, width, height } = e.getBoundingClientRect();
    return { left, right, top, bottom, width, height };
  };
  const [boxes, heads] = [shown.map(place), titles.map(place)];
  const all = [...boxes, ...heads];
  closed(boxes.filter((_, k) => shown[k].closest("#maps")), heads.find((_, k) => titles[k].closest("#maps")), all, 1.8 * size);
  const [left, top] = [Math.min(...all.map((b) => b.left)), Math.min(...all.map((b) => b.top))];
  const wide = Math.max(...all.map((b) => b.right)) - left;
  const made = document.createElement("canvas");
  const c = made.getContext("2d");
  const font = (bold) => `${bold ? "600 " : ""}${size}px "Source Sans 3", "Helvetica Neue", Arial, sans-serif`;
  c.font = font(false);
  const lines = wrapped(c, page.describe(), wide - size);
  const head = size * (2.2 + 1.35 * lines.length);
  made.width = ratio * wide;
  made.height = ratio * (Math.max(...all.map((b) => b.bottom)) - top + head);
  c.scale(ratio, ratio);
  c.fillStyle = GROUND;
  c.fillRect(0, 0, made.width, made.height);
  sharpen(ratio);
  page.redraw();
  for (const [k, b] of boxes.entries()) c.drawImage(shown[k], b.left - left, b.top - top + head, b.width, b.height);
  sharpen(null);
  page.redraw();
  c.fillStyle = INK;
  c.textBaseline = "top";
  c.font = font(true);
  c.fillText(t("title"), size * 0.5, size * 0.4);
  c.font = font(false);
  for (const [k, text] of lines.entries()) c.fillText(text, size * 0.5, size * (1.8 + 1.35 * k));
  c.fillStyle = SOFT;
  for (const [k, b] of heads.entries()) c.fillText(titles[k].textContent, b.left - left + size * 0.5, b.top - top + head + 2);
  return made;
}

/** Move the maps up over the controls that stand between them and the views; their title comes right above them. */
function closed(maps, title, all, room) {
  if (!maps.length || !title) return;
  const top = Math.min(...maps.map((b) => b.top));
  const above = Math.max(...all.filter((b) => b !== title && !maps.includes(b)).map((b) => b.bottom));
  const gap = Math.max(0, top - room - above);
  for (const b of maps) Object.assign(b, { top: b.top - gap, bottom: b.bottom - gap });
  Object.assign(title, { left: maps[0].left, right: maps[0].right, top: top - gap - room, bottom: top - gap });
}

/** A text in lines that are no wider than this; it is broken after commas. */
function wrapped(c, text, most) {
  const lines = [""];
  for (const part of text.split(/(?<=, )/)) {
    if (lines.at(-1) && c.measureText(lines.at(-1) + part).width > most) lines.push("");
    lines.push(lines.pop() + part);
  }
  return lines;
}

/** A film of the run from its start, made by the server. */
async function film(page, run) {
  const most = page.catalogue.limits.rendered;
  try {
    const long = Math.min(most, seconds(page, 5));
    const answer = await request("/api/jobs/render", { seconds: String(long) }, { method: "POST", body: run });
    const { job } = await answer.json();
    page.notice(t("mp4_working"), true);
    page.link.on("job", ({ job: own, state, answer: said }) => {
      if (own !== job) return;
      if (state === "failed") page.notice(said.error);
      if (state !== "done") return;
      page.notice(t("mp4_done"));
      save(address(`/api/jobs/${job}/run.mp4`, { download: "1" }), "udd-run.mp4");
    });
    page.link.say({ type: "watch", job });
  } catch (error) {
    page.notice(error.message);
  }
}
