/** All valves in rows, as many as there are: only those that are seen are in the page. */

import type { FleetRow } from "./api";
import { fill, h, say } from "./dom";
import { cycles, digits, fixed } from "./numbers";

/** States from bad to good, each with a sign that is told apart without colour. */
export const STATES: [string, string, string][] = [
  ["eol-reached", "■", "the limit is reached"],
  ["act-now", "▲", "replace before the next cycles"],
  ["plan", "◆", "plan a replacement"],
  ["watch", "●", "a fault grows; there is time"],
  ["unknown", "?", "the log does not tell"],
  ["healthy", "✓", "nothing grows"],
];

const ROW = 40;

/** Rows that are printed at most. */
const PRINTED = 2000;

type Key = "worst" | "valve" | "fault" | "cycle" | "severity" | "rul" | "replace";

const HEADS: [Key | null, string][] = [
  ["worst", "state"], ["valve", "valve"], ["fault", "fault"], ["cycle", "cycle"], ["severity", "wear"], [null, "past"],
  ["rul", "cycles left (5 to 95 %)"], [null, "fan"], ["replace", "replace by"], [null, "remark"],
];

const PLACES = new Map(STATES.map(([state], index) => [state, index]));
const place = (status: string): number => PLACES.get(status) ?? STATES.length;
/** Names as people order them; made once, since thousands of rows are put in order several times a second. */
const { compare: by_name } = new Intl.Collator(undefined, { numeric: true });
const last = (value: number | null): number => value ?? Number.POSITIVE_INFINITY;
/** Worst first: by state, then by the cycles that are left almost surely. */
const worse = (a: FleetRow, b: FleetRow): number =>
  place(a.status) - place(b.status) || last(a.rul[0]) - last(b.rul[0]) || by_name(a.valve, b.valve);

const ORDERS: Record<Key, (a: FleetRow, b: FleetRow) => number> = {
  worst: worse,
  valve: (a, b) => by_name(a.valve, b.valve),
  fault: (a, b) => by_name(a.fault, b.fault) || worse(a, b),
  cycle: (a, b) => b.cycle - a.cycle || worse(a, b),
  severity: (a, b) => (b.severity ?? -1) - (a.severity ?? -1) || worse(a, b),
  rul: (a, b) => last(a.rul[1]) - last(b.rul[1]) || worse(a, b),
  replace: (a, b) => last(a.replace_by_cycle) - last(b.replace_by_cycle) || worse(a, b),
};

export class FleetTable {
  readonly element: HTMLElement;
  readonly states = new Set<string>();
  private rows = new Map<string, FleetRow>();
  private sorted: FleetRow[] = [];
  private order: Key = "worst";
  private backwards = false;
  private words = "";
  private readonly heads = h("div", { class: "fleet-row fleet-heads", role: "row" });
  private readonly body = h("div", { class: "fleet-body", role: "rowgroup" });
  private readonly found = h("span", { role: "status" });
  private drawing = false;

  constructor(private readonly open: (valve: string) => void) {
    const search = h("input", { type: "text", "aria-label": "search for a valve or a fault", placeholder: "search valve or fault", oninput: () => {
      this.words = search.value.trim().toLowerCase();
      this.sort();
    } });
    this.element = h("div", {}, h("div", { class: "bar" }, search, this.found),
      h("div", { class: "fleet-table", role: "table", "aria-label": "valves, worst first" }, this.heads, this.body));
    addEventListener("scroll", () => this.later(), { passive: true });
    addEventListener("resize", () => this.later());
    addEventListener("beforeprint", () => this.draw(true));
    addEventListener("afterprint", () => this.draw());
    this.show_heads();
  }

  show(rows: Map<string, FleetRow>): void {
    this.rows = rows;
    this.sort();
  }

  worst(): FleetRow | undefined {
    return [...this.rows.values()].reduce<FleetRow | undefined>((least, row) => (least === undefined || worse(row, least) < 0 ? row : least), undefined);
  }

  /** Leads a keyboard back to a valve that was looked at. */
  focus(valve: string): void {
    const place = this.sorted.findIndex((row) => row.valve === valve);
    if (place < 0) return;
    const top = scrollY + this.body.getBoundingClientRect().top + place * ROW;
    if (top < scrollY || top > scrollY + innerHeight - ROW) scrollTo(0, top - innerHeight / 3);
    this.draw();
    this.button(valve)?.focus({ preventScroll: true });
  }

  private button(valve: string): HTMLElement | null {
    return this.body.querySelector(`[data-valve="${CSS.escape(valve)}"]`);
  }

  toggle(state: string): void {
    if (!this.states.delete(state)) this.states.add(state);
    this.sort();
  }

  private sort(): void {
    const fits = (row: FleetRow) => (this.states.size === 0 || this.states.has(row.status))
      && (this.words === "" || row.valve.toLowerCase().includes(this.words) || row.fault.includes(this.words));
    this.sorted = [...this.rows.values()].filter(fits).sort(ORDERS[this.order]);
    if (this.backwards) this.sorted.reverse();
    say(this.found, this.sorted.length === this.rows.size ? "" : `${this.sorted.length} of ${this.rows.size} shown`);
    this.later();
  }

  private show_heads(): void {
    fill(this.heads, ...HEADS.map(([key, label]) => {
      if (key === null) return h("span", { role: "columnheader" }, label);
      const is_chosen = this.order === key;
      const sign = is_chosen ? (this.backwards ? " ↑" : " ↓") : "";
      return h("span", { role: "columnheader", "aria-sort": is_chosen ? (this.backwards ? "descending" : "ascending") : "none" },
        h("button", { type: "button", class: "plain", onclick: () => {
          this.backwards = is_chosen && !this.backwards;
          this.order = key;
          this.show_heads();
          this.sort();
        } }, label + sign));
    }));
  }

  private later(): void {
    if (this.drawing) return;
    this.drawing = true;
    requestAnimationFrame(() => {
      this.drawing = false;
      this.draw();
    });
  }

  /** Puts the rows that are seen into the page, and room for the others. */
  private draw(all = false): void {
    if (!this.element.isConnected || this.element.closest("[hidden]")) return;
    const top = this.body.getBoundingClientRect().top;
    const first = all ? 0 : Math.max(0, Math.floor(-top / ROW) - 5);
    const count = all ? PRINTED : Math.ceil(innerHeight / ROW) + 12;
    const seen = this.sorted.slice(first, first + count);
    const focused = (document.activeElement as HTMLElement | null)?.dataset["valve"];
    this.body.style.height = `${this.sorted.length * ROW}px`;
    fill(this.body, ...seen.map((row, index) => this.row(row, first + index)));
    if (focused !== undefined) this.button(focused)?.focus({ preventScroll: true });
  }

  private row(row: FleetRow, index: number): HTMLElement {
    const [, sign] = STATES[place(row.status)] ?? ["", "?"];
    const cell = (...children: (Node | string | null)[]) => h("span", { role: "cell" }, ...children);
    const [low, middle, high] = row.rul;
    const left = middle === null ? "–" : `${cycles(middle)} (${cycles(low)} to ${cycles(high)})`;
    const by = row.status === "eol-reached" ? "now" : row.replace_by?.slice(0, 10) ?? (row.replace_by_cycle === null ? "–" : `cycle ${row.replace_by_cycle}`);
    const leak = row.leak_mm2 !== null ? `${digits(row.leak_mm2, 3)} mm²` : row.severity === null ? "–" : `${fixed(100 * row.severity, 0)} %`;
    const button = h("button", { type: "button", class: "plain", "data-valve": row.valve, onclick: () => this.open(row.valve) }, row.valve);
    const element = h("div", { class: "fleet-row", role: "row", "aria-rowindex": index + 2 },
      cell(h("span", { class: `state state-${row.status}` }, `${sign} ${row.status.replaceAll("-", " ")}`)), cell(button),
      cell(row.fault === "none" ? "–" : row.fault), cell(String(row.cycle)), cell(leak), cell(spark(row)), cell(left), cell(fan(row)), cell(by),
      h("span", { role: "cell", class: "why", title: row.caveat ?? "" }, row.caveat ?? ""));
    element.style.transform = `translateY(${index * ROW}px)`;
    return element;
  }
}

const SVG = "http://www.w3.org/2000/svg";

function svg(width: number, height: number, label: string, shapes: [string, Record<string, string | number>][]): SVGElement {
  const make = (tag: string, attributes: Record<string, string | number>) => {
    const element = document.createElementNS(SVG, tag);
    Object.entries(attributes).forEach(([name, value]) => element.setAttribute(name, String(value)));
    return element;
  };
  const element = make("svg", { width, height, viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": label });
  shapes.forEach(([tag, attributes]) => element.append(make(tag, attributes)));
  return element;
}

/** The wear over the cycles; the line at the top is the limit. */
function spark(row: FleetRow): SVGElement {
  const [width, height] = [90, 28];
  const [cycles, values] = row.small;
  const [first, last_] = [cycles[0] ?? 0, cycles[cycles.length - 1] ?? 1];
  const x = (cycle: number) => 2 + ((cycle - first) * (width - 4)) / Math.max(1, last_ - first);
  const y = (value: number) => height - 3 - Math.min(1.15, Math.max(0, value)) * (height - 8);
  const path = cycles.map((cycle, index) => {
    const value = values[index];
    if (value === null || value === undefined) return "";
    return `${index === 0 || values[index - 1] === null ? "M" : "L"}${x(cycle).toFixed(1)} ${y(value).toFixed(1)}`;
  }).join("");
  return svg(width, height, `wear ${row.severity === null ? "none" : `${fixed(100 * row.severity, 0)} % of the limit`}`, [
    ["line", { x1: 0, x2: width, y1: y(1), y2: y(1), class: "limit" }],
    ["path", { d: path, class: "spark" }],
  ]);
}

/** The cycles that are left, 5 to 95 %, on a scale that ends at 200 by its square root. */
function fan(row: FleetRow): SVGElement | null {
  const [low, middle, high] = row.rul;
  if (low === null || middle === null || high === null) return null;
  const [width, height] = [110, 28];
  const x = (value: number) => 2 + (width - 4) * Math.min(1, Math.sqrt(Math.max(0, value) / 200));
  return svg(width, height, `${cycles(low)} to ${cycles(high)} cycles left`, [
    ["line", { x1: x(0), x2: x(0), y1: 4, y2: height - 4, class: "axis" }],
    ["rect", { x: x(low), y: 9, width: Math.max(2, x(high) - x(low)), height: 10, class: "fan" }],
    ["line", { x1: x(middle), x2: x(middle), y1: 6, y2: height - 6, class: "spark" }],
  ]);
}
