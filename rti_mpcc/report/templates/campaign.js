"use strict";
// Sorts the table of all cases by a click on a head, and filters its rows.
const cases = document.querySelector("#cases table"), body = cases.tBodies[0];
const value = (row, column) => {
  const text = row.cells[column].textContent.replace("\u2212", "-");
  return text === "\u2013" || text === "" ? null : isNaN(text) ? text : Number(text);
};
[...cases.tHead.rows[0].cells].forEach((head, column) => {
  head.style.cursor = "pointer";
  head.addEventListener("click", () => {
    const down = head.getAttribute("aria-sort") === "ascending" ? -1 : 1;
    for (const each of cases.tHead.rows[0].cells) each.removeAttribute("aria-sort");
    head.setAttribute("aria-sort", down > 0 ? "ascending" : "descending");
    const rows = [...body.rows].sort((one, other) => {
      const [a, b] = [value(one, column), value(other, column)];
      if (a === null || b === null) return (a === null) - (b === null);  // what is not known comes last
      return down * (a > b ? 1 : a < b ? -1 : 0);
    });
    body.append(...rows);
  });
});
document.getElementById("filter").addEventListener("input", (event) => {
  for (const row of body.rows) row.hidden = !row.textContent.toLowerCase().includes(event.target.value.toLowerCase());
});
