// The words of the page, all from one file.
let words = {};

export async function load() {
  words = await (await fetch("/static/texts.json")).json();
  for (const e of document.querySelectorAll("[data-text]")) e.textContent = t(e.dataset.text);
  for (const e of document.querySelectorAll("[data-label]")) e.setAttribute("aria-label", t(e.dataset.label));
  for (const e of document.querySelectorAll("[data-hint]")) e.placeholder = t(e.dataset.hint);
  document.title = t("title");
}

export const has = (key) => key in words;
export const list = (key) => words[key] ?? [];

export function t(key, values = {}) {
  return (words[key] ?? key).replace(/\{(\w+)\}/g, (all, name) => values[name] ?? all);
}
