// Sorts a table by a column when its heading is used; again, in the other direction.
for (const table of document.querySelectorAll(".wide table")) {
  const rows = table.tBodies[0];
  if (!table.tHead || rows.rows.length < 2) continue;
  [...table.tHead.rows[0].cells].forEach((head, column) => {
    if (!head.textContent.trim()) return;
    const button = document.createElement("button");
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      const up = head.getAttribute("aria-sort") !== "ascending";
      for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", up ? "ascending" : "descending");
      const value = (row) => row.cells[column]?.textContent.trim() ?? "";
      const compare = (a, b) => {
        const [x, y] = [parseFloat(value(a)), parseFloat(value(b))];
        if (!isNaN(x) && !isNaN(y)) return x - y;
        // Rows without a number come last in both directions.
        if (isNaN(x) !== isNaN(y)) return (isNaN(x) ? 1 : -1) * (up ? 1 : -1);
        return value(a).localeCompare(value(b));
      };
      const sorted = [...rows.rows].sort((a, b) => (up ? compare(a, b) : compare(b, a)));
      rows.append(...sorted);
    });
  });
}
