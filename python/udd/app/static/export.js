// What can be taken away: table, picture, film, Python.
import { python } from "./address.js";
import { address, request } from "./link.js";
import { t } from "./texts.js";

const $ = (id) => document.getElementById(id);

export function exporting(page) {
  const run = () => JSON.stringify(page.home);
  const acts = {
    csv: () => save(address("/api/run.csv", { run: run(), seconds: String(seconds(page, 1)) }), "udd-run.csv"),
    png: () => picture().toBlob((blob) => save(URL.createObjectURL(blob), "udd.png")),
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

/** All pictures that are shown, side by side as on the page. */
function picture() {
  const shown = [...$("explore").querySelectorAll("canvas")].filter((c) => c.offsetParent && c.width);
  const boxes = shown.map((c) => c.getBoundingClientRect());
  const [left, top] = [Math.min(...boxes.map((b) => b.left)), Math.min(...boxes.map((b) => b.top))];
  const ratio = window.devicePixelRatio || 1;
  const made = document.createElement("canvas");
  made.width = ratio * (Math.max(...boxes.map((b) => b.right)) - left);
  made.height = ratio * (Math.max(...boxes.map((b) => b.bottom)) - top);
  const c = made.getContext("2d");
  c.fillStyle = "#fff";
  c.fillRect(0, 0, made.width, made.height);
  for (const [k, box] of boxes.entries()) c.drawImage(shown[k], ratio * (box.left - left), ratio * (box.top - top));
  return made;
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
