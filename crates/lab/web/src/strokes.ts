/** Strokes: measured and simulated, their difference, phases; one run or all, before and after. */

import type { Description, LeftOut, MeasuredRun, Selection, SimulatedRun, StrokeInfo } from "./api";
import { Chart, type Column, type Line } from "./charts";
import { fill, h } from "./dom";
import { digits, fixed } from "./numbers";

/** Points of a run: as many as there are pixels, or some for a small chart. */
const POINTS = { one: 1800, all: 360 };

const MEASURED: Line = { label: "measured", colour: "measured", width: 5 };
const NOW: Line = { label: "model", colour: "model", width: 2 };
const BEFORE: Line = { label: "valve file", colour: "before", width: 1.5, dash: [5, 4] };

const CHANNELS: Record<string, { name: string; unit: string }> = {
  position: { name: "position", unit: "mm" },
  chamber: { name: "chamber pressure", unit: "kPa" },
  pipe: { name: "pipe pressure", unit: "kPa" },
};

interface Shown {
  run: number;
  time: Column;
  measured: Column;
  strokes: StrokeInfo[];
  charts: { path: Chart; rest: Chart; before?: Chart };
}

/** What is shown of the strokes. */
interface Kept {
  mode: "one" | "all";
  run: number;
  condition: number | null;
  channel: string;
  sides: boolean;
}

export class Strokes {
  readonly element = h("section", { class: "strokes", "aria-labelledby": "strokes-title" });
  private lab!: Description;
  private mode: Kept["mode"] = "one";
  private run = 0;
  private condition: number | null = null;
  private channel = "position";
  private sides = false;
  private window: [number, number] | null = null;
  private shown: Shown[] = [];
  private last: SimulatedRun[] = [];
  private before = new Map<number, Column>();
  /** A run that contradicts all others. */
  private odd: LeftOut | null = null;
  private readonly warning = h("p", { class: "notice bad odd-run", role: "status", hidden: true });
  private readonly body = h("div", { class: "stroke-charts" });
  private readonly bar = h("div", { class: "bar", role: "toolbar", "aria-label": "what is shown" });

  /** `wants` is called when other samples are needed than those that are shown. What is shown stays over a reload of the tab
   *  under the name `kept`, where one is given. */
  constructor(private readonly wants: () => void, private readonly kept: string | null = null) {
    const before = kept === null ? null : sessionStorage.getItem(kept);
    if (before !== null) ({ mode: this.mode, run: this.run, condition: this.condition, channel: this.channel, sides: this.sides } = JSON.parse(before) as Kept);
    this.element.append(h("h2", { id: "strokes-title" }, "Strokes"), this.warning, this.bar, this.body);
    this.element.addEventListener("keydown", (event) => this.key(event));
  }

  begin(lab: Description): void {
    this.lab = lab;
    const traces = lab.runs.filter((run) => run.is_trace).length;
    this.run = Math.min(this.run, Math.max(0, traces - 1));
    if (lab.runs.every((run) => run.condition !== this.condition)) this.condition = null;
    if (!lab.channels.includes(this.channel)) this.channel = "position";
    this.controls();
  }

  /** Marks the run that a search has left out, and says which condition of it should be corrected. */
  mark(odd: LeftOut | null): void {
    if (JSON.stringify(odd) === JSON.stringify(this.odd)) return;
    this.odd = odd;
    this.warning.hidden = odd === null;
    if (odd) {
      fill(this.warning, h("strong", {}, `${odd.run} contradicts all other runs. `), `Correct its ${this.slip(odd)} `,
        h("button", { type: "button", onclick: () => this.show_run(odd.run) }, "show this run"));
    }
    this.controls();
    if (this.shown.length > 0) this.wants();
  }

  /** Shows a run alone. */
  show_run(name: string): void {
    const index = this.lab.runs.findIndex((run) => run.name === name);
    if (index < 0) return;
    this.mode = "one";
    this.run = index;
    this.window = null;
    this.controls();
    this.wants();
    this.element.scrollIntoView();
    this.bar.querySelector<HTMLElement>('[data-choose="run"]')?.focus({ preventScroll: true });
  }

  /** Which condition of a run is mistyped, what it says and what it should be about. */
  private slip(odd: LeftOut): string {
    const run = this.lab.runs.find((one) => one.name === odd.run);
    const ambient_kpa = run ? run.supply_kpa - run.supply_kpa_gauge : 0;
    const shown = (si: number) => odd.condition === "supply_pressure" ? `${fixed(1e-3 * si - ambient_kpa, 1)} kPa over ambient`
      : odd.condition === "temperature" ? `${fixed(si, 1)} K`
      : si === 0 ? "none" : `${fixed(1e6 * si, 3)} mm²`;
    return `${odd.condition.replaceAll("_", " ")}: written down is ${shown(odd.stated)} (an error of ${fixed(1e3 * odd.stated_rmse_m, 3)} mm is left), `
      + `about ${shown(odd.right)} explains it (to ${fixed(1e3 * odd.right_rmse_m, 3)} mm).`;
  }

  get has_traces(): boolean {
    return this.lab.runs.some((run) => run.is_trace);
  }

  /** Which samples the charts need. */
  selection(): Selection {
    const traces = this.lab.runs.map((run, index) => ({ run, index })).filter(({ run }) => run.is_trace);
    const runs = this.mode === "one"
      ? traces.filter(({ index }) => index === this.run)
      : traces.filter(({ run }) => this.condition === null || run.condition === this.condition);
    return {
      runs: runs.map(({ index }) => index),
      window_s: this.mode === "one" ? this.window : null,
      points: POINTS[this.mode],
      channel: this.channel,
    };
  }

  /** The same of what is on the screen, and close by unless a hand moves: no more is drawn, and so no more is asked for. */
  near(hand_moves: boolean): Selection {
    const near = this.shown.filter(({ charts }) => is_near(charts.rest.element, hand_moves ? 0 : AHEAD)
      || is_near(charts.path.element, hand_moves ? 0 : AHEAD)).map(({ run }) => run);
    const all = this.selection();
    return { ...all, runs: all.runs.filter((run) => near.includes(run)) };
  }

  /** Lays out the charts for what was recorded. `before` is the valve file's model at the same samples. */
  lay_out(measured: MeasuredRun[], before: SimulatedRun[]): void {
    this.before = new Map(before.map((run) => [run.run, run.simulated]));
    const same = this.shown.length === measured.length
      && this.shown.every((shown, index) => shown.run === measured[index]!.run)
      && this.body.dataset["kind"] === this.kind();
    if (!same) {
      this.shown.forEach(({ charts }) => [charts.path, charts.rest, charts.before].forEach((chart) => chart?.remove()));
      this.shown = [];
      fill(this.body);
      this.body.dataset["kind"] = this.kind();
      this.body.classList.toggle("many", this.mode === "all");
    }
    measured.forEach((run, index) => {
      const nothing: Column = run.time_s.map(() => null);
      const known = this.shown[index];
      if (known) {
        known.time = run.time_s;
        known.measured = run.measured ?? nothing;
      } else {
        const shown: Shown = {
          run: run.run, time: run.time_s, measured: run.measured ?? nothing, strokes: [], charts: this.charts(run.run, () => shown.strokes),
        };
        this.shown.push(shown);
        this.body.append(this.card(shown));
      }
    });
    const size = measured.reduce((count, run) => count + run.time_s.length, 0);
    this.body.dataset["samples"] = String(size);
  }

  /** Draws a model's strokes. */
  show(simulated: SimulatedRun[]): void {
    this.last = simulated;
    for (const shown of this.shown) {
      const run = simulated.find((one) => one.run === shown.run);
      if (!run || run.simulated.length !== shown.time.length || !(is_near(shown.charts.path.element, AHEAD) || is_near(shown.charts.rest.element, AHEAD))) continue;
      shown.strokes = run.strokes;
      const before = this.before.get(shown.run) ?? shown.time.map(() => null);
      const rest = difference(shown.measured, run.simulated);
      const rest_before = difference(shown.measured, before);
      const { path, rest: below, before: beside } = shown.charts;
      const window = this.mode === "one" ? this.window : null;
      if (beside) {
        path.show(shown.time, shown.measured, run.simulated);
        beside.show(shown.time, shown.measured, before);
        beside.zoom(window);
      } else {
        path.show(shown.time, shown.measured, before, run.simulated);
      }
      below.show(shown.time, rest_before, rest);
      path.zoom(window);
      below.zoom(window);
      const times = run.strokes.map((stroke) => `${stroke.direction} measured ${digits(stroke.measured_s)} s, model ${digits(stroke.simulated_s)} s`);
      path.tell(times.join("; "));
    }
  }

  private kind(): string {
    return `${this.mode} ${this.channel} ${this.sides} ${this.odd?.run ?? ""}`;
  }

  private charts(run: number, strokes: () => StrokeInfo[]): Shown["charts"] {
    const { name, unit } = CHANNELS[this.channel]!;
    const small = this.mode === "all";
    const title = `${this.lab.runs[run]!.name}, ${name}`;
    const zoomed = small ? {} : { zoomed: (window: [number, number] | null) => this.zoom(window) };
    const shared = { x: small ? "" : "time (s)", group: `run ${this.mode === "all" ? "" : run}`, phases: strokes, small, ...zoomed };
    const at_least = this.channel === "position" ? { y_at_least: [0, this.lab.stroke_mm] as [number, number] } : {};
    const main = { ...shared, ...at_least, name_phases: !small, height: small ? 150 : 330, y: `${name} (${unit})` };
    const sides = this.sides && !small;
    const path = new Chart({ ...main, title: sides ? `${title}, after` : title, lines: sides ? [MEASURED, NOW] : [MEASURED, BEFORE, NOW] });
    const before = sides ? new Chart({ ...main, title: `${title}, before`, lines: [MEASURED, BEFORE] }) : undefined;
    const rest = new Chart({
      ...shared, title: `${title}, measured minus model`, height: small ? 84 : 190,
      y: small ? unit : `difference (${unit})`, symmetric: true,
      lines: [{ ...BEFORE, label: "valve file" }, { ...NOW, label: "measured − model", width: small ? 1.25 : 1.5 }],
    });
    return before ? { path, rest, before } : { path, rest };
  }

  private card(shown: Shown): HTMLElement {
    const { path, rest, before } = shown.charts;
    const words = this.conditions(shown.run);
    if (this.mode === "all") {
      const open = () => {
        this.mode = "one";
        this.run = shown.run;
        this.controls();
        this.wants();
      };
      const name = h("button", { class: "plain", type: "button", onclick: open, title: "show this run alone" }, words);
      return h("article", { class: this.is_odd(shown.run) ? "card odd" : "card" }, h("h3", {}, name), path.element, rest.element);
    }
    const upper = before
      ? h("div", { class: "sides" },
          h("div", {}, h("h3", {}, "before: the valve file"), before.element),
          h("div", {}, h("h3", {}, "after: the sliders"), path.element))
      : path.element;
    return h("div", {}, upper, rest.element);
  }

  private is_odd(index: number): boolean {
    return this.odd !== null && this.lab.runs[index]!.name === this.odd.run;
  }

  /** A run in words: its conditions. */
  conditions(index: number): string {
    const run = this.lab.runs[index]!;
    const parts = [`${digits(run.supply_kpa_gauge, 3)} kPa over ambient`];
    if (this.lab.runs.some((other) => Math.abs(other.temperature_k - run.temperature_k) > 1)) parts.push(`${digits(run.temperature_k, 3)} K`);
    if (run.leak_to_atmosphere_mm2 > 0) parts.push(`leak to atmosphere ${digits(run.leak_to_atmosphere_mm2, 3)} mm²`);
    if (run.leak_from_supply_mm2 > 0) parts.push(`leak from supply ${digits(run.leak_from_supply_mm2, 3)} mm²`);
    return `${this.is_odd(index) ? "⚠ " : ""}${index + 1}: ${parts.join(", ")}${this.is_odd(index) ? " (contradicts all others)" : ""}`;
  }

  private controls(): void {
    const traces = this.lab.runs.map((run, index) => ({ run, index })).filter(({ run }) => run.is_trace);
    const renew = () => {
      this.controls();
      this.wants();
    };
    const choose = <T extends string>(label: string, value: T, options: [T, string][], chosen: (value: T) => void) =>
      h("label", {}, `${label} `, h("select", { "data-choose": label, onchange: (event: Event) => { chosen((event.target as HTMLSelectElement).value as T); renew(); } },
        ...options.map(([option, name]) => h("option", { value: option, selected: option === value }, name))));
    const { mode, run, condition, channel, sides } = this;
    if (this.kept !== null) sessionStorage.setItem(this.kept, JSON.stringify({ mode, run, condition, channel, sides } satisfies Kept));
    // The keyboard stays on the choice that it made.
    const focused = (document.activeElement as HTMLElement | null)?.dataset["choose"];
    const conditions = [...new Set(traces.map(({ run }) => run.condition))];
    const first_of = (condition: number) => traces.find(({ run }) => run.condition === condition)!.index;
    fill(this.bar,
      choose("show", this.mode, [["one", "one run"], ["all", `all runs (${traces.length})`]], (mode) => { this.mode = mode; this.window = null; }),
      this.mode === "one" && choose("run", String(this.run), traces.map(({ index }) => [String(index), this.conditions(index)]),
        (value) => { this.run = Number(value); this.window = null; }),
      this.mode === "all" && conditions.length > 1 && choose("condition", String(this.condition ?? "any"),
        [["any", "any"], ...conditions.map((condition): [string, string] => [String(condition), this.conditions(first_of(condition)).replace(/^(⚠ )?\d+: /, "")])],
        (value) => { this.condition = value === "any" ? null : Number(value); }),
      this.lab.channels.length > 1 && choose("channel", this.channel,
        this.lab.channels.map((channel): [string, string] => [channel, CHANNELS[channel]!.name]), (channel) => { this.channel = channel; }),
      this.mode === "one" && h("label", {}, h("input", { type: "checkbox", "data-choose": "sides", checked: this.sides, onchange: () => { this.sides = !this.sides; renew(); } }), " before and after side by side"),
      this.mode === "one" && h("span", { class: "zoom", role: "group", "aria-label": "part of the time that is shown" },
        ...([["−", "show more", () => this.scale(1.6)], ["+", "show less", () => this.scale(0.6)], ["◀", "earlier", () => this.pan(-0.25)], ["▶", "later", () => this.pan(0.25)], ["all", "show all", () => this.zoom(null)]] as [string, string, () => void][])
          .map(([sign, name, act]) => h("button", { type: "button", title: name, "aria-label": name, onclick: act }, sign))));
    if (focused !== undefined) this.bar.querySelector<HTMLElement>(`[data-choose="${focused}"]`)?.focus();
    this.bar.title = "Drag over a chart to zoom, shift and drag to move, ctrl and wheel to zoom, double-click for all";
  }

  private extent(): [number, number] {
    return [0, this.lab.runs[this.run]?.end_s ?? 1];
  }

  private zoom(window: [number, number] | null): void {
    const [from, to] = this.extent();
    if (window) {
      const size = Math.min(Math.max(window[1] - window[0], 0.02), to - from);
      const start = Math.min(Math.max(window[0], from), to - size);
      window = size >= to - from ? null : [start, start + size];
    }
    this.window = window;
    this.show(this.last);
    this.wants();
  }

  private scale(factor: number): void {
    const [min, max] = this.window ?? this.extent();
    const middle = 0.5 * (min + max);
    this.zoom([middle - (middle - min) * factor, middle + (max - middle) * factor]);
  }

  private pan(share: number): void {
    if (!this.window) return;
    const [min, max] = this.window;
    const shift = share * (max - min);
    this.zoom([min + shift, max + shift]);
  }

  private key(event: KeyboardEvent): void {
    if (this.mode !== "one" || event.target instanceof HTMLSelectElement || event.ctrlKey || event.metaKey || event.altKey) return;
    const acts: Record<string, () => void> = {
      "+": () => this.scale(0.6), "-": () => this.scale(1.6), "0": () => this.zoom(null),
      ArrowLeft: () => this.pan(-0.25), ArrowRight: () => this.pan(0.25),
    };
    const act = acts[event.key];
    if (act) {
      event.preventDefault();
      act();
    }
  }
}

/** Drawn before it comes to the screen, px. */
const AHEAD = 300;

/** Whether an element is on the screen or this close to it; what is far away is drawn when it comes. */
function is_near(element: Element, px: number): boolean {
  const box = element.getBoundingClientRect();
  return box.bottom > -px && box.top < innerHeight + px;
}

function difference(measured: Column, model: Column): Column {
  return measured.map((value, index) => {
    const other = model[index];
    return value === null || value === undefined || other === null || other === undefined ? null : value - other;
  });
}
