// Shows only the parts of the page that are about the chosen mission, class of faults, measure and so on. Without the
// script, the page shows everything.
const form = document.querySelector("form.choice");
const parts = [...document.querySelectorAll("[data-about]")].map((part) => ({ part, about: JSON.parse(part.dataset.about) }));
const values = new Map();
for (const { about } of parts) {
  for (const [key, value] of Object.entries(about)) {
    if (!values.has(key)) values.set(key, new Set());
    values.get(key).add(value);
  }
}

const selects = new Map();
for (const [key, all] of values) {
  if (all.size < 2) continue;
  const select = document.createElement("select");
  select.add(new Option("all", ""));
  for (const value of all) select.add(new Option(value || "none", `=${value}`));
  select.addEventListener("change", show);
  const label = document.createElement("label");
  label.append(`${key} `, select);
  form.append(label, " ");
  selects.set(key, select);
}
const shown = document.createElement("output");
form.append(shown);
form.hidden = selects.size == 0;

/** Hides the cells of hidden columns, and columns of settings that are the same in all shown rows. */
function showColumns(table) {
  const heads = [...table.tHead.rows[0].cells];
  const rows = [...table.tBodies[0].rows];
  const visible = rows.filter((row) => !row.hidden);
  const isConstant = (column) => visible.length > 1 && new Set(visible.map((row) => row.cells[column].textContent)).size == 1;
  heads.forEach((head, column) => {
    if (head.dataset.setting != null) head.hidden = visible.length < rows.length && isConstant(column);
  });
  for (const row of rows) {
    let column = 0;
    for (const cell of row.cells) {
      cell.hidden = heads.slice(column, column + cell.colSpan).every((head) => head.hidden);
      column += cell.colSpan;
    }
  }
  // The best row is that of the primary measure.
  const isOther = selects.get("measure")?.value && table.querySelector("td.least:not([hidden])");
  table.classList.toggle("by-cell", Boolean(isOther));
}

/** Shows only the parts of a figure that are about what is chosen. Its files always have all parts. */
function crop(svg) {
  const boxes = [...svg.querySelectorAll("[data-about]")].filter(({ hidden }) => !hidden).map((part) => part.getBBox());
  if (!boxes.length) return;
  const top = Math.min(...boxes.map(({ y }) => y));
  const bottom = Math.max(...boxes.map(({ y, height }) => y + height));
  svg.setAttribute("viewBox", `0 ${top} ${boxes[0].width} ${bottom - top}`);
}

function show() {
  for (const { part, about } of parts) {
    part.hidden = Object.entries(about).some(([key, value]) => (selects.get(key)?.value || `=${value}`) != `=${value}`);
  }
  for (const table of document.querySelectorAll(".wide table")) showColumns(table);
  document.querySelectorAll(".drawing svg").forEach(crop);
  const named = parts.filter(({ part }) => /^(DETAILS|TR)$/.test(part.tagName));
  const left = named.filter(({ part }) => !part.hidden);
  if (left.length == 1) left[0].part.open = true;
  shown.value = left.length < named.length ? `${left.length} of ${named.length} shown` : "";
}
show();
