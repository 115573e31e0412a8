/** The force that the model lacks along the recorded motion, against position, velocity and pressure. */

import { Refused, type Bin, type Missing as Answer } from "./api";
import { Chart, type Column } from "./charts";
import { fill, h } from "./dom";

const AXES: [string, string, number][] = [
  ["position_m", "position (mm)", 1e3],
  ["velocity_m_per_s", "velocity (mm/s), + opens", 1e3],
  ["chamber_pressure_pa", "chamber pressure (kPa)", 1e-3],
];

export class Missing {
  readonly element = h("section", { "aria-labelledby": "missing-title" });
  private readonly body = h("div", { class: "trio" });
  private readonly words = h("p", {});
  private charts: { chart: Chart; bins: { closing: Bin[]; opening: Bin[] } }[] = [];
  private is_seen = false;
  private is_stale = true;
  private has_traces = true;
  private timer = 0;

  /** `ask` knows what the model that is looked at lacks. */
  constructor(private readonly ask: () => Promise<Answer>) {
    this.element.append(h("h2", { id: "missing-title" }, "The force that the model lacks"),
      h("p", {}, "What would have to push (+ towards open) for the model to follow the record; bars are two standard errors. Two lines apart by the same everywhere are friction, a line that bends with position is a spring, and so on."),
      this.words, this.body);
  }

  begin(has_traces: boolean): void {
    this.has_traces = has_traces;
    this.is_stale = true;
    this.seen(this.is_seen);
  }

  changed(): void {
    this.is_stale = true;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.seen(this.is_seen), 250) as unknown as number;
  }

  seen(is_seen: boolean): void {
    this.is_seen = is_seen;
    if (is_seen && this.is_stale) void this.renew();
  }

  private async renew(): Promise<void> {
    this.is_stale = false;
    if (!this.has_traces) {
      fill(this.words, "Stroke times alone show no motion to tell a force from.");
      return;
    }
    let answer: Answer;
    try {
      answer = await this.ask();
    } catch (error) {
      fill(this.words, error instanceof Refused ? error.message : String(error));
      return;
    }
    if (!answer.force) {
      fill(this.words, "The recorded strokes are too short to tell a missing force.");
      return;
    }
    fill(this.words, `Pressure: ${answer.force.pressure === "measured" ? "measured" : "simulated along the measured motion"}.`);
    if (this.charts.length === 0) {
      this.charts = AXES.map(([, label, factor]) => {
        const bins = { closing: [] as Bin[], opening: [] as Bin[] };
        const chart = new Chart({
          title: `missing force against ${label}`, height: 260, x: label, y: "missing force (N)", symmetric: true,
          bars: () => [["model", bins.closing], ["closing", bins.opening]].flatMap(([colour, of]) => (of as Bin[]).map((bin) => ({ colour: colour as string, x: bin.at * factor, low: bin.force_n - 2 * bin.standard_error_n, high: bin.force_n + 2 * bin.standard_error_n }))),
          lines: [{ label: "closing", colour: "model", width: 2 }, { label: "opening", colour: "closing", width: 2, dash: [6, 4] }],
        });
        return { chart, bins };
      });
      fill(this.body, ...this.charts.map(({ chart }) => chart.element));
    }
    AXES.forEach(([id, , factor], index) => {
      const of = answer.force!.against[id]!;
      Object.assign(this.charts[index]!.bins, of);
      const places = [...new Set([...of.closing, ...of.opening].map((bin) => bin.at * factor))].sort((a, b) => a - b);
      const values = (bins: Bin[], at: (bin: Bin) => number): Column =>
        places.map((place) => { const bin = bins.find((one) => one.at * factor === place); return bin ? at(bin) : undefined; });
      this.charts[index]!.chart.show(places, values(of.closing, (bin) => bin.force_n), values(of.opening, (bin) => bin.force_n));
    });
  }
}
