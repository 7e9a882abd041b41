// Renders the formulas of a page by the KaTeX next to this file. A formula that cannot be read throws.
for (const formula of document.querySelectorAll(".arithmatex")) {
  const source = formula.textContent.trim().replace(/^\\\[/, "").replace(/\\\]$/, "");
  katex.render(source, formula, { displayMode: true });
}
