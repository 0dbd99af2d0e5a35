// Terms of the verdict with a dotted underline, and one sentence each.

/** Underline each term where it first stands under an element; `terms`: [words, sentence] each. */
export function explain(element, terms) {
  const left = new Map(terms);
  const walker = document.createTreeWalker(element, NodeFilter.SHOW_TEXT);
  const texts = [];
  while (walker.nextNode()) texts.push(walker.currentNode);
  for (const text of texts) {
    if (text.parentElement.closest("abbr")) continue;
    const found = [...left.keys()].find((word) => text.data.includes(word));
    if (!found) continue;
    const rest = text.splitText(text.data.indexOf(found));
    rest.splitText(found.length);
    rest.replaceWith(term(found, left.get(found)));
    left.delete(found);
  }
}

/** Words with a dotted underline and the sentence that explains them. */
export function term(words, sentence) {
  const abbr = document.createElement("abbr");
  abbr.className = "term";
  abbr.tabIndex = 0;
  abbr.title = sentence;
  abbr.append(words);
  return abbr;
}
