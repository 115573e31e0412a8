/** Tables whose rows are put in order by a click on a heading. */

import { h } from "./dom";

/** Fewer rows are seen at a glance. */
const FEW = 4;

/** The number that a cell begins with; dates and names are none, and stand in order as texts. */
function number(text: string): number {
  const found = /^[>±\s]*([+-]?\d[\d.]*(?:e[+-]?\d+)?)(?![\w-])/i.exec(text.replaceAll("−", "-"));
  return found ? Number(found[1]) : Number.NaN;
}

export function sortable(table: HTMLTableElement): void {
  const body = table.tBodies[0];
  if (!body || body.rows.length < FEW || !table.tHead) return;
  const first = [...body.rows];
  const heads = [...table.tHead.rows[0]!.cells];
  heads.forEach((head, column) => {
    const name = head.textContent ?? "";
    const press = () => {
      const now = head.getAttribute("aria-sort");
      const next = now === "ascending" ? "descending" : now === "descending" ? null : "ascending";
      heads.forEach((other) => other.removeAttribute("aria-sort"));
      if (next) head.setAttribute("aria-sort", next);
      const text = (row: HTMLTableRowElement) => row.cells[column]?.textContent ?? "";
      const order = (a: HTMLTableRowElement, b: HTMLTableRowElement) => {
        const [x, y] = [number(text(a)), number(text(b))];
        // What is no number comes last; names stand as people order them.
        if (Number.isNaN(x) !== Number.isNaN(y)) return Number.isNaN(x) ? 1 : -1;
        const by = Number.isNaN(x) ? text(a).localeCompare(text(b), undefined, { numeric: true }) : x - y;
        return next === "descending" ? -by : by;
      };
      body.append(...(next ? first.toSorted(order) : first));
    };
    head.replaceChildren(h("button", { type: "button", class: "plain sort", onclick: press, title: "put the rows in this order" }, name));
  });
}
