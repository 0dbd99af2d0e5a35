// The words of the page: one file for each language.
export const LANGUAGES = { en: "English", nl: "Nederlands", de: "Deutsch" };
const KEY = "udd-language";
let words = {};

/** The language that was chosen here before, or else the first of the browser's that the page has. */
function preferred() {
  let chosen = null;
  try {
    chosen = localStorage.getItem(KEY);
  } catch {} // a browser may keep nothing
  const wanted = [chosen, ...navigator.languages.map((tag) => tag.slice(0, 2).toLowerCase())];
  return wanted.find((language) => language in LANGUAGES) ?? "en";
}

export async function load() {
  const language = preferred();
  words = await (await fetch(`/static/texts.${language}.json`)).json();
  document.documentElement.lang = language;
  for (const e of document.querySelectorAll("[data-text]")) e.textContent = t(e.dataset.text);
  for (const e of document.querySelectorAll("[data-label]")) e.setAttribute("aria-label", t(e.dataset.label));
  for (const e of document.querySelectorAll("[data-hint]")) e.placeholder = t(e.dataset.hint);
  document.title = t("title");
}

/** Keep another language, and load the page in it. */
export function speak(language) {
  try {
    localStorage.setItem(KEY, language);
  } catch {}
  location.reload();
}

export const has = (key) => key in words;
export const list = (key) => words[key] ?? [];

export function t(key, values = {}) {
  return (words[key] ?? key).replace(/\{(\w+)\}/g, (all, name) => values[name] ?? all);
}
