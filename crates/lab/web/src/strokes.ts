/** Strokes: measured and simulated, their difference, phases; one run or all, before and after. */

import type { Description, MeasuredRun, Selection, SimulatedRun, StrokeInfo } from "./api";
import { Chart, type Column, type Line } from "./charts";
import { fill, h } from "./dom";
import { digits } from "./numbers";

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

export class Strokes {
  readonly element = h("section", { class: "strokes", "aria-labelledby": "strokes-title" });
  private lab!: Description;
  private mode: "one" | "all" = "one";
  private run = 0;
  private condition: number | null = null;
  private channel = "position";
  private sides = false;
  private window: [number, number] | null = null;
  private shown: Shown[] = [];
  private last: SimulatedRun[] = [];
  private before = new Map<number, Column>();
  private readonly body = h("div", { class: "stroke-charts" });
  private readonly bar = h("div", { class: "bar", role: "toolbar", "aria-label": "what is shown" });

  /** `wants` is called when other samples are needed than those that are shown. */
  constructor(private readonly wants: () => void) {
    this.element.append(h("h2", { id: "strokes-title" }, "Strokes"), this.bar, this.body);
    this.element.addEventListener("keydown", (event) => this.key(event));
  }

  begin(lab: Description): void {
    this.lab = lab;
    const traces = lab.runs.filter((run) => run.is_trace).length;
    this.run = Math.min(this.run, Math.max(0, traces - 1));
    if (!lab.channels.includes(this.channel)) this.channel = "position";
    this.controls();
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
      if (!run || run.simulated.length !== shown.time.length || !is_near(shown.charts.path.element)) continue;
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
    return `${this.mode} ${this.channel} ${this.sides}`;
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
      return h("article", { class: "card" }, h("h3", {}, name), path.element, rest.element);
    }
    const upper = before
      ? h("div", { class: "sides" },
          h("div", {}, h("h3", {}, "before: the valve file"), before.element),
          h("div", {}, h("h3", {}, "after: the sliders"), path.element))
      : path.element;
    return h("div", {}, upper, rest.element);
  }

  /** A run in words: its conditions. */
  conditions(index: number): string {
    const run = this.lab.runs[index]!;
    const parts = [`${digits(run.supply_kpa_gauge, 3)} kPa over ambient`];
    if (this.lab.runs.some((other) => Math.abs(other.temperature_k - run.temperature_k) > 1)) parts.push(`${digits(run.temperature_k, 3)} K`);
    if (run.leak_to_atmosphere_mm2 > 0) parts.push(`leak to atmosphere ${digits(run.leak_to_atmosphere_mm2, 3)} mm²`);
    if (run.leak_from_supply_mm2 > 0) parts.push(`leak from supply ${digits(run.leak_from_supply_mm2, 3)} mm²`);
    return `${index + 1}: ${parts.join(", ")}`;
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
    const conditions = [...new Set(traces.map(({ run }) => run.condition))];
    const first_of = (condition: number) => traces.find(({ run }) => run.condition === condition)!.index;
    fill(this.bar,
      choose("show", this.mode, [["one", "one run"], ["all", `all runs (${traces.length})`]], (mode) => { this.mode = mode; this.window = null; }),
      this.mode === "one" && choose("run", String(this.run), traces.map(({ index }) => [String(index), this.conditions(index)]),
        (value) => { this.run = Number(value); this.window = null; }),
      this.mode === "all" && conditions.length > 1 && choose("condition", String(this.condition ?? "any"),
        [["any", "any"], ...conditions.map((condition): [string, string] => [String(condition), this.conditions(first_of(condition)).replace(/^\d+: /, "")])],
        (value) => { this.condition = value === "any" ? null : Number(value); }),
      this.lab.channels.length > 1 && choose("channel", this.channel,
        this.lab.channels.map((channel): [string, string] => [channel, CHANNELS[channel]!.name]), (channel) => { this.channel = channel; }),
      this.mode === "one" && h("label", {}, h("input", { type: "checkbox", checked: this.sides, onchange: () => { this.sides = !this.sides; renew(); } }), " before and after side by side"),
      this.mode === "one" && h("span", { class: "zoom", role: "group", "aria-label": "part of the time that is shown" },
        ...([["−", "show more", () => this.scale(1.6)], ["+", "show less", () => this.scale(0.6)], ["◀", "earlier", () => this.pan(-0.25)], ["▶", "later", () => this.pan(0.25)], ["all", "show all", () => this.zoom(null)]] as [string, string, () => void][])
          .map(([sign, name, act]) => h("button", { type: "button", title: name, "aria-label": name, onclick: act }, sign))));
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

/** Whether an element is on the screen or close by; what is far away is drawn when it comes. */
function is_near(element: Element): boolean {
  const box = element.getBoundingClientRect();
  return box.bottom > -300 && box.top < innerHeight + 300;
}

function difference(measured: Column, model: Column): Column {
  return measured.map((value, index) => {
    const other = model[index];
    return value === null || value === undefined || other === null || other === undefined ? null : value - other;
  });
}
