/** A fleet: how many valves stand where, all of them in rows, and one valve's own page. */

import type { FleetRow, ValvePast } from "./api";
import { h, say } from "./dom";
import { FleetTable, STATES } from "./fleet";
import { ValvePage } from "./valve";

/** What stands in the page's address before the name of the valve that is looked at. */
const HASH = "#valve=";

export class FleetView {
  readonly element: HTMLElement;
  readonly one: ValvePage;
  private readonly counts = h("div", { class: "counts", role: "group", "aria-label": "valves by state; press to show only these" });
  private readonly summary = h("p", { class: "summary", role: "status" });
  private readonly table = new FleetTable((valve) => this.open(valve));
  private readonly list: HTMLElement;
  /** By state; made once, so that the keyboard stays on the one that it pressed while rows come. */
  private readonly buttons = new Map(STATES.map(([state, sign, words]) =>
    [state, h("button", { type: "button", class: `count state-${state}`, title: words, onclick: () => { this.table.toggle(state); this.show_counts(); } },
      h("strong", {}), h("span", {}, `${sign} ${state.replaceAll("-", " ")}`))]));
  private rows = new Map<string, FleetRow>();

  /** `ask` knows the past of a valve; `beside` stands above the rows. */
  constructor(ask: (valve: string) => Promise<ValvePast>, beside: HTMLElement | null = null) {
    this.one = new ValvePage(ask, () => this.open(null));
    this.list = h("div", { class: "fleet" }, this.counts, this.summary, beside, this.table.element);
    this.counts.append(...this.buttons.values());
    this.element = h("div", {}, this.list, this.one.element);
    addEventListener("hashchange", () => this.route());
  }

  show(rows: Map<string, FleetRow>): void {
    this.rows = rows;
    this.table.show(rows);
    this.show_counts();
  }

  /** The page's address says which valve is looked at, so that a reload and the back button lead there. */
  route(): void {
    const valve = location.hash.startsWith(HASH) ? decodeURIComponent(location.hash.slice(HASH.length)) : null;
    const was = this.one.valve;
    this.one.element.hidden = valve === null;
    this.list.hidden = valve !== null;
    void this.one.show(valve);
    if (valve === null) {
      this.table.show(this.rows);
      if (was !== null) this.table.focus(was);
    } else {
      this.element.scrollIntoView();
      this.one.focus();
    }
  }

  private open(valve: string | null): void {
    const hash = valve === null ? "" : `${HASH}${encodeURIComponent(valve)}`;
    if (location.hash !== hash) location.hash = hash;
    else this.route();
  }

  private show_counts(): void {
    const { rows } = this;
    const counts = new Map<string, number>();
    for (const { status } of rows.values()) counts.set(status, (counts.get(status) ?? 0) + 1);
    const of = (state: string) => counts.get(state) ?? 0;
    for (const [state, button] of this.buttons) {
      const pressed = this.table.states.has(state);
      button.setAttribute("aria-pressed", String(pressed));
      button.disabled = of(state) === 0 && !pressed;
      say(button.firstElementChild!, String(of(state)));
    }
    const worst = this.table.worst();
    const urgent = of("eol-reached") + of("act-now");
    say(this.summary, rows.size === 0 ? "No row has come yet."
      : urgent === 0 ? `${rows.size} valves, none at its end. ${worst && worst.replace_by_cycle !== null ? `Next: ${worst.valve}, replace by cycle ${worst.replace_by_cycle}.` : ""}`
      : `${urgent} of ${rows.size} valves must be replaced now. Worst: ${worst!.valve}.`);
  }
}
