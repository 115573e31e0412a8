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
/** Names as people order them. */
const { compare: by_name } = new Intl.Collator(undefined, { numeric: true });
const last = (value: number | null): number => value ?? Number.POSITIVE_INFINITY;

/** A valve with what thousands are put in order by: names are compared once, when a valve comes. */
interface Ranked {
  row: FleetRow;
  state: number;
  name: number;
}

/** -1, 0 or 1; infinity is as large as infinity. */
const by = (a: number, b: number): number => (a < b ? -1 : a > b ? 1 : 0);
/** Worst first: by state, then by the cycles that are left almost surely. */
const worse = (a: Ranked, b: Ranked): number =>
  a.state - b.state || by(last(a.row.rul[0]), last(b.row.rul[0])) || a.name - b.name;

const ORDERS: Record<Key, (a: Ranked, b: Ranked) => number> = {
  worst: worse,
  valve: (a, b) => a.name - b.name,
  fault: (a, b) => (a.row.fault === b.row.fault ? 0 : by_name(a.row.fault, b.row.fault)) || worse(a, b),
  cycle: (a, b) => b.row.cycle - a.row.cycle || worse(a, b),
  severity: (a, b) => by(b.row.severity ?? -1, a.row.severity ?? -1) || worse(a, b),
  rul: (a, b) => by(last(a.row.rul[1]), last(b.row.rul[1])) || worse(a, b),
  replace: (a, b) => by(last(a.row.replace_by_cycle), last(b.row.replace_by_cycle)) || worse(a, b),
};

export class FleetTable {
  readonly element: HTMLElement;
  readonly states = new Set<string>();
  /** All valves, in the order of the last time: what is almost in order is put in order fast. */
  private all: Ranked[] = [];
  private readonly known = new Map<string, Ranked>();
  private sorted: FleetRow[] = [];
  /** The rows that are in the page, by valve. */
  private drawn = new Map<string, { row: FleetRow; element: HTMLElement }>();
  private order: Key = "worst";
  private backwards = false;
  private words = "";
  private readonly heads = h("div", { class: "fleet-row fleet-heads", role: "row" });
  private readonly body = h("div", { class: "fleet-body", role: "rowgroup", onkeydown: (event: KeyboardEvent) => this.key(event) });
  /** The valve whose row the tab key leads to; the arrow keys lead to the others. */
  private stop: string | null = null;
  private readonly table = h("div", { class: "fleet-table", role: "grid", "aria-label": "valves; the arrow keys move among them" });
  private readonly found = h("span", { role: "status" });
  private drawing = false;

  constructor(private readonly open: (valve: string) => void) {
    const search = h("input", { type: "text", "aria-label": "search for a valve or a fault", placeholder: "search valve or fault", oninput: () => {
      this.words = search.value.trim().toLowerCase();
      this.sort();
    } });
    this.table.append(this.heads, this.body);
    this.body.addEventListener("focusin", (event) => {
      const valve = (event.target as HTMLElement).dataset["valve"];
      if (valve !== undefined) this.lead_to(valve);
    });
    this.element = h("div", {}, h("div", { class: "bar" }, search, this.found, h("span", { class: "keys" }, "arrow keys move among the valves")),
      this.table);
    addEventListener("scroll", () => this.later(), { passive: true });
    addEventListener("resize", () => this.later());
    addEventListener("beforeprint", () => this.draw(true));
    addEventListener("afterprint", () => this.draw());
    this.make_heads();
  }

  show(rows: Map<string, FleetRow>): void {
    this.take(rows);
    this.sort();
  }

  worst(): FleetRow | undefined {
    return this.all.reduce<Ranked | undefined>((least, one) => (least === undefined || worse(one, least) < 0 ? one : least), undefined)?.row;
  }

  private take(rows: Map<string, FleetRow>): void {
    const is_new = rows.size !== this.known.size || [...rows.keys()].some((valve) => !this.known.has(valve));
    if (is_new) {
      this.known.clear();
      this.all = [...rows.keys()].sort(by_name).map((valve, name) => ({ row: rows.get(valve)!, state: 0, name }));
      for (const one of this.all) this.known.set(one.row.valve, one);
    }
    for (const one of this.all) {
      one.row = rows.get(one.row.valve)!;
      one.state = place(one.row.status);
    }
  }

  /** Leads a keyboard back to a valve that was looked at. */
  focus(valve: string): void {
    const place = this.sorted.findIndex((row) => row.valve === valve);
    if (place < 0) return;
    const top = this.top(place);
    this.focus_at(place, top < scrollY || top > scrollY + innerHeight - ROW ? top - innerHeight / 3 : null);
  }

  /** Where a row is in the page. */
  private top(place: number): number {
    return scrollY + this.body.getBoundingClientRect().top + place * ROW;
  }

  private focus_at(place: number, scroll: number | null): void {
    const { valve } = this.sorted[place]!;
    if (scroll !== null) scrollTo(0, scroll);
    this.stop = valve;
    this.draw();
    this.button(valve)?.focus({ preventScroll: true });
  }

  /** Moves by the arrow keys, a screen at a time, or to an end. */
  private key(event: KeyboardEvent): void {
    const valve = (event.target as HTMLElement).dataset["valve"];
    const from = this.sorted.findIndex((row) => row.valve === valve);
    if (from < 0 || event.ctrlKey || event.metaKey || event.altKey) return;
    const [last, screen] = [this.sorted.length - 1, Math.max(1, Math.floor(innerHeight / ROW) - 2)];
    const places: Record<string, number> = {
      ArrowDown: from + 1, ArrowUp: from - 1, PageDown: from + screen, PageUp: from - screen, Home: 0, End: last,
    };
    const wanted = places[event.key];
    if (wanted === undefined) return;
    event.preventDefault();
    const place = Math.min(Math.max(wanted, 0), last);
    const top = this.top(place);
    this.focus_at(place, top < scrollY ? top : top > scrollY + innerHeight - ROW ? top - innerHeight + 1.5 * ROW : null);
  }

  /** Lets the tab key lead to this valve alone. */
  private lead_to(valve: string): void {
    this.stop = valve;
    for (const [name, { element }] of this.drawn) {
      element.querySelector("button")!.tabIndex = name === valve ? 0 : -1;
    }
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
    this.sorted = this.all.sort(ORDERS[this.order]).map(({ row }) => row).filter(fits);
    if (this.backwards) this.sorted.reverse();
    say(this.found, this.sorted.length === this.all.length ? "" : `${this.sorted.length} of ${this.all.length} shown`);
    this.later();
  }

  /** The headings; made once, so that the keyboard stays on the one that it pressed. */
  private make_heads(): void {
    fill(this.heads, ...HEADS.map(([key, label]) => {
      if (key === null) return h("span", { role: "columnheader" }, label);
      const press = () => {
        this.backwards = this.order === key && !this.backwards;
        this.order = key;
        this.mark_heads();
        this.sort();
      };
      return h("span", { role: "columnheader", "data-key": key }, h("button", { type: "button", class: "plain", onclick: press }, label));
    }));
    this.mark_heads();
  }

  private mark_heads(): void {
    HEADS.forEach(([key, label], index) => {
      if (key === null) return;
      const head = this.heads.children[index]!;
      const is_chosen = this.order === key;
      head.setAttribute("aria-sort", is_chosen ? (this.backwards ? "descending" : "ascending") : "none");
      say(head.firstElementChild!, label + (is_chosen ? (this.backwards ? " ↑" : " ↓") : ""));
    });
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
    this.put(seen.map((row, index) => this.element_of(row, first + index)));
    this.table.setAttribute("aria-rowcount", String(this.sorted.length + 1));
    // Where the row that the tab key leads to is far away, it leads to the first that is seen, but not for good.
    const { stop } = this;
    const on_screen = seen[Math.min(seen.length - 1, Math.max(0, Math.ceil(-top / ROW) - first))];
    const near = stop !== null && this.drawn.has(stop) ? stop : on_screen?.valve;
    if (near !== undefined) this.lead_to(near);
    this.stop = stop;
    if (focused !== undefined && document.activeElement === document.body) this.button(focused)?.focus({ preventScroll: true });
  }

  /** The element of a row at its place: the one that is in the page, where nothing of the row has changed. */
  private element_of(row: FleetRow, index: number): { row: FleetRow; element: HTMLElement } {
    const known = this.drawn.get(row.valve);
    const one = known?.row === row ? known : { row, element: this.row(row) };
    one.element.setAttribute("aria-rowindex", String(index + 2));
    one.element.style.transform = `translateY(${index * ROW}px)`;
    return one;
  }

  /** These rows in this order; those that stay are not touched, so that scrolling is cheap and the keyboard keeps its place. */
  private put(rows: { row: FleetRow; element: HTMLElement }[]): void {
    const stay = new Set(rows.map(({ element }) => element));
    for (const child of [...this.body.children]) if (!stay.has(child as HTMLElement)) child.remove();
    let next = this.body.firstElementChild;
    for (const { element } of rows) {
      if (element === next) next = next.nextElementSibling;
      else this.body.insertBefore(element, next);
    }
    this.drawn = new Map(rows.map((one) => [one.row.valve, one]));
  }

  private row(row: FleetRow): HTMLElement {
    const [, sign] = STATES[place(row.status)] ?? ["", "?"];
    const cell = (...children: (Node | string | null)[]) => h("span", { role: "gridcell" }, ...children);
    const [low, middle, high] = row.rul;
    const left = middle === null ? "–" : `${cycles(middle)} (${cycles(low)} to ${cycles(high)})`;
    const replace_by = row.status === "eol-reached" ? "now" : row.replace_by?.slice(0, 10) ?? (row.replace_by_cycle === null ? "–" : `cycle ${row.replace_by_cycle}`);
    const leak = row.leak_mm2 !== null ? `${digits(row.leak_mm2, 3)} mm²` : row.severity === null ? "–" : `${fixed(100 * row.severity, 0)} %`;
    const button = h("button", { type: "button", class: "plain", "data-valve": row.valve, onclick: () => this.open(row.valve) }, row.valve);
    return h("div", { class: "fleet-row", role: "row" },
      cell(h("span", { class: `state state-${row.status}` }, `${sign} ${row.status.replaceAll("-", " ")}`)), cell(button),
      cell(row.fault === "none" ? "–" : row.fault), cell(String(row.cycle)), cell(leak), cell(spark(row)), cell(left), cell(fan(row)), cell(replace_by),
      h("span", { role: "gridcell", class: "why", title: row.caveat ?? "" }, row.caveat ?? ""));
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
