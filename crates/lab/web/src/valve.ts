/** One valve: how it stands, its past, its fan, what was remarked. */

import { Refused, type ValvePast } from "./api";
import { Chart, type Column } from "./charts";
import { fill, h, say, table } from "./dom";
import { STATES } from "./fleet";
import { cycles, digits, fixed, percent } from "./numbers";

/** Half the width of the alpha cone, as a share of the life that is left (Saxena et al. 2008). */
const ALPHA = 0.2;

export class ValvePage {
  readonly element = h("section", { class: "valve-page", hidden: true, "aria-labelledby": "valve-title" });
  valve: string | null = null;
  private readonly title = h("h2", { id: "valve-title", tabindex: -1 });
  private readonly facts = h("dl", { class: "facts" });
  private readonly faults = h("div", { class: "faults" });
  private readonly remarks = h("div", { class: "remarks" });
  private readonly notice = h("p", { class: "notice bad", role: "alert", hidden: true });
  private limits: [number, number] = [0, 0];
  private readonly wear: Chart;
  private readonly life: Chart;
  private readonly times: Chart;

  /** `ask` knows the past of a valve; `back` leads to all valves, where there are others. */
  constructor(private readonly ask: (valve: string) => Promise<ValvePast>, back: (() => void) | null) {
    const shared = { height: 230, x: "cycle", group: "valve" };
    this.wear = new Chart({ ...shared, title: "wear", y: "wear (1 = limit)", y_at_least: [0, 1.1],
      lines: [{ label: "wear", colour: "model", width: 2 }], levels: () => [{ value: 1, label: "limit" }] });
    this.life = new Chart({ ...shared, height: 280, title: "cycles left", y: "cycles left", y_at_least: [0, 1], bands: [[3, 1]],
      lines: [
        { label: "present estimate − 20 %", colour: "before", width: 1, dash: [3, 3] },
        { label: "5 %", colour: "model", width: 1 }, { label: "estimate", colour: "model", width: 2.5 }, { label: "95 %", colour: "model", width: 1 },
        { label: "present estimate + 20 %", colour: "before", width: 1, dash: [3, 3] },
      ] });
    this.times = new Chart({ ...shared, title: "stroke times", y: "stroke time (s)", y_at_least: [0, 0.1],
      lines: [{ label: "closing", colour: "model", width: 1.5 }, { label: "opening", colour: "before", width: 1.5, dash: [6, 3] }],
      levels: () => [{ value: this.limits[0], label: "limit of closing" }, { value: this.limits[1], label: "limit of opening" }].filter(({ value }) => value > 0) });
    fill(this.element,
      back && h("p", {}, h("button", { type: "button", onclick: back }, "← all valves")), this.title, this.notice, this.facts,
      h("h3", {}, "Cycles left, 5 to 95 %"), this.life.element,
      h("h3", {}, "Wear"), this.wear.element, h("h3", {}, "Stroke times"), this.times.element,
      h("h3", {}, "What it could be"), this.faults, h("h3", {}, "Remarks"), this.remarks);
  }

  begin(limits: [number, number]): void {
    this.limits = limits;
  }

  /** Leads a keyboard and a screen reader to it. */
  focus(): void {
    this.title.focus({ preventScroll: true });
  }

  async show(valve: string | null): Promise<void> {
    this.valve = valve;
    if (valve !== null) await this.renew();
  }

  async renew(): Promise<void> {
    const { valve } = this;
    if (valve === null) return;
    try {
      const past = await this.ask(valve);
      this.notice.hidden = true;
      if (valve === this.valve) this.fill(past);
    } catch (error) {
      this.notice.hidden = false;
      say(this.notice, error instanceof Refused ? error.message : String(error));
    }
  }

  private fill(known: ValvePast): void {
    const { row, past, now } = known;
    const [, sign, words] = STATES.find(([state]) => state === row.status) ?? ["", "?", ""];
    fill(this.title, `${row.valve} `, h("span", { class: `state state-${row.status}` }, `${sign} ${row.status.replaceAll("-", " ")}`));
    const [low, middle, high] = row.rul;
    const facts: [string, string | null][] = [
      ["what that means", words],
      ["fault", row.fault === "none" ? "none" : row.fault],
      ["leak", row.leak_mm2 === null ? null : `${digits(row.leak_mm2, 3)} mm²${row.leak_limit_mm2 === null ? "" : ` of ${digits(row.leak_limit_mm2, 3)} mm² at the limit`}`],
      ["wear", row.severity === null ? null : `${fixed(100 * row.severity, 0)} % of the limit`],
      ["cycles left", middle === null ? null : `${cycles(middle)} (${cycles(low)} to ${cycles(high)})`],
      ["end of life", now.eol_cycle === null ? null : `cycle ${fixed(now.eol_cycle, 1)}${now.eol_time ? `, ${now.eol_time.slice(0, 10)}` : ""}`],
      ["replace by", row.status === "eol-reached" ? "now" : row.replace_by_cycle === null ? null : `cycle ${row.replace_by_cycle}${row.replace_by ? `, ${row.replace_by.slice(0, 10)}` : ""}`],
      ["now at", `cycle ${row.cycle}${row.time ? `, ${row.time.slice(0, 10)}` : ""}, ${row.rows} rows`],
      ["be careful", row.caveat],
    ];
    fill(this.facts, ...facts.filter(([, text]) => text !== null && text !== "").map(([name, text]) => h("div", {}, h("dt", {}, name), h("dd", {}, text))));
    const [at, wear, low_rul, mid_rul, high_rul, closing, opening] = past as [Column, Column, Column, Column, Column, Column, Column];
    const end = now.eol_cycle;
    const cone = (factor: number): Column => at.map((cycle) => (end === null ? null : Math.max(0, end - (cycle as number)) * factor));
    // A bound that is far beyond all others would leave nothing to be seen of them.
    const most = 3 * Math.max(...mid_rul.map((value) => value ?? 0), 1);
    const within = (values: Column): Column => values.map((value) => (value === null || value === undefined ? null : Math.min(value, most)));
    this.life.show(at, cone(1 - ALPHA), within(low_rul), within(mid_rul), within(high_rul), cone(1 + ALPHA));
    this.life.tell(middle === null ? "nothing wears" : `${cycles(middle)} cycles left, ${cycles(low)} to ${cycles(high)}`);
    this.wear.show(at, wear);
    this.wear.tell(row.severity === null ? "none" : `${fixed(100 * row.severity, 0)} % of the limit`);
    this.times.show(at, closing, opening);
    const shares = Object.entries(now.fault_probability ?? {}).filter(([, share]) => share >= 0.005).sort((a, b) => b[1] - a[1]);
    fill(this.faults, ...shares.map(([name, share]) => {
      const inside = h("span", {});
      inside.style.width = `${100 * share}%`;
      return h("div", { class: "measure fault" }, h("span", { class: "name" }, name.replaceAll("_", " ")), h("span", { class: "track" }, inside), h("span", { class: "text" }, percent(share)));
    }));
    fill(this.remarks, known.remarks.length === 0 ? h("p", {}, "None.")
      : table("remarks, the newest first", ["cycle", "remark"], known.remarks.map(([cycle, text]) => [String(cycle), text])));
  }
}
