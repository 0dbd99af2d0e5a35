// The keyboard: every key of the list in texts.en.json.
const TYPED = new Set(["INPUT", "SELECT", "TEXTAREA"]);
const SLIDES = new Set(["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown", "Home", "End", "PageUp", "PageDown"]);

/** Whether a key belongs to the element that has the focus. */
function belongs(on, key) {
  if (!TYPED.has(on?.tagName) || on.type === "checkbox") return false;
  return on.type !== "range" || SLIDES.has(key);
}

export function listen(actions) {
  // Who chose from a list by mouse goes on with the page; by keyboard, with the list.
  let mouse = false;
  document.addEventListener("pointerdown", () => (mouse = true), true);
  document.addEventListener("keydown", () => (mouse = false), true);
  document.addEventListener("change", (e) => mouse && e.target.tagName === "SELECT" && e.target.blur());
  document.addEventListener("keydown", (e) => {
    if (e.ctrlKey || e.metaKey || e.altKey || e.defaultPrevented) return;
    const on = document.activeElement;
    if (belongs(on, e.key)) return;
    if (document.querySelector("dialog[open]")) return;
    if (e.key === " " && (on?.tagName === "BUTTON" || on?.tagName === "SUMMARY" || on?.type === "checkbox")) return;
    const act = actions[e.key.length === 1 ? e.key.toLowerCase() : e.key];
    if (!act) return;
    e.preventDefault();
    act(e);
  });
}

/** Tabs as readers of screens expect them: arrow keys move between them. */
export function tabs(elements, chosen) {
  const choose = (tab, focus) => {
    for (const other of elements) {
      const own = other === tab;
      other.setAttribute("aria-selected", String(own));
      other.tabIndex = own ? 0 : -1;
      document.getElementById(other.getAttribute("aria-controls")).hidden = !own;
    }
    if (focus) tab.focus();
    chosen(tab.id);
  };
  for (const [k, tab] of elements.entries()) {
    tab.addEventListener("click", () => choose(tab));
    tab.addEventListener("keydown", (e) => {
      const by = { ArrowLeft: -1, ArrowRight: 1 }[e.key];
      if (!by) return;
      e.preventDefault();
      e.stopPropagation();
      choose(elements[(k + by + elements.length) % elements.length], true);
    });
  }
  return choose;
}
