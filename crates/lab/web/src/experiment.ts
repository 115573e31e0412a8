/** Experiment: a run that is only thought of, and what each model still alive predicts for it. */

import { api, Refused, type Description, type Model, type PlannedRun, type Prediction } from "./api";
import { Chart, type Line } from "./charts";
import { fill, h, say } from "./dom";
import { fixed } from "./numbers";
import type { Explain } from "./explain";
import type { Sliders } from "./sliders";

interface Alive {
  name: string;
  model: Model;
  /** Models that differ from it by a standard deviation each, in independent ways. */
  spread: Model[];
}

/** Lines differ in colour and in dash, so that they differ in grey too. */
const LINES: Omit<Line, "label">[] = [
  { colour: "model", width: 2.5 },
  { colour: "before", width: 2, dash: [7, 4] },
  { colour: "good", width: 2, dash: [2, 3] },
  { colour: "ink", width: 1.5, dash: [10, 3, 2, 3] },
  { colour: "ink-soft", width: 1.5 },
];

export class Experiment {
  readonly element = h("section", { "aria-labelledby": "experiment-title" });
  private readonly pattern = h("div", { class: "pattern" });
  private readonly conditions = h("div", { class: "bar" });
  private readonly chart_place = h("div", {});
  private readonly words = h("p", { role: "status" });
  private readonly toml = h("pre", {});
  private chart: Chart | null = null;
  private names = "";
  private lab!: Description;
  private plan!: PlannedRun;
  private is_seen = false;
  private timer = 0;
  private asked = 0;

  constructor(private readonly sliders: Sliders, private readonly explain: Explain) {
    this.element.append(h("h2", { id: "experiment-title" }, "Before the valve is stroked"),
      h("p", {}, "Draw a command pattern and conditions: every model that is still alive says what it expects, with the band (5 to 95 %) that data or tolerances leave open. Where they part by more than their bands and the noise, that run tells them apart."),
      this.pattern, this.conditions, this.chart_place, this.words,
      h("details", {}, h("summary", {}, "this run for campaign.toml"), this.toml));
    explain.plan = (plan) => {
      this.plan = structuredClone(plan);
      this.controls();
      document.getElementById("tab-experiment")?.click();
    };
    explain.listen(() => this.changed());
  }

  begin(lab: Description): void {
    const first = lab.runs[0]!;
    const end = first.end_s ?? 9;
    if (!this.lab) {
      this.plan = {
        commands: [{ at_s: 0, close: true }, { at_s: round(0.45 * end), close: false }],
        end_s: round(end),
        supply_pressure_pa: 1e3 * first.supply_kpa,
        temperature_k: first.temperature_k,
        leak_to_atmosphere_m2: 0,
        leak_from_supply_m2: 0,
      };
    }
    this.lab = lab;
    this.controls();
  }

  changed(): void {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => { if (this.is_seen) void this.renew(); }, 40) as unknown as number;
  }

  seen(is_seen: boolean): void {
    this.is_seen = is_seen;
    if (is_seen) void this.renew();
  }

  /** The models that are alive: the answer of the last search and its twins, the file's, and the sliders' where it is none of these. */
  private alive(): Alive[] {
    // The answer is as sure as the data make it, the valve file as its tolerances say; what sliders say has no band of its own.
    const all: Alive[] = [];
    const { answer } = this.explain;
    if (answer && answer.document.recommended.length > 0) {
      all.push({ name: answer.document.recommended.join(" + "), model: answer.model, spread: answer.spread });
      all.push(...answer.twins.flatMap((twins) => twins.with.map(({ effect, model, spread }) => ({ name: effect, model, spread }))));
    }
    const tolerances = this.lab.parameters.map(({ key, value, tolerance }) => ({ ...this.lab.model, parameters: { [key]: value * Math.exp(tolerance) } }));
    all.push({ name: "valve file", model: this.lab.model, spread: tolerances });
    const text = (one: Alive) => JSON.stringify(one.model);
    const sliders: Alive = { name: "sliders", model: this.sliders.model(), spread: [] };
    const rest = all.filter((one, index) => all.findIndex((other) => text(other) === text(one)) === index);
    return (rest.some((one) => text(one) === text(sliders)) ? rest : [sliders, ...rest]).slice(0, LINES.length);
  }

  private async renew(): Promise<void> {
    const alive = this.alive();
    this.asked += 1;
    const { asked } = this;
    this.toml.textContent = this.as_toml();
    try {
      const answer = await api.predict(alive.map((one) => one.model), alive.map((one) => one.spread), this.plan);
      if (asked !== this.asked) return;
      const names = alive.map((one) => one.name).join();
      if (!this.chart || names !== this.names) {
        this.chart?.remove();
        this.names = names;
        this.chart = new Chart({
          title: "predicted position", height: 260, x: "time (s)", y: "position (mm)", y_at_least: [0, this.lab.stroke_mm],
          lines: [
            ...alive.map((one, index) => ({ ...LINES[index]!, label: one.name })),
            // The edges of the bands, which are filled.
            ...alive.flatMap((one, index) => ["5 %", "95 %"].map((edge) => ({ label: `${one.name}, ${edge}`, colour: LINES[index]!.colour, width: 0, unnamed: true }))),
          ],
          bands: alive.map((_, index) => [alive.length + 2 * index + 1, alive.length + 2 * index]),
          band_colours: alive.map((_, index) => LINES[index]!.colour),
        });
        fill(this.chart_place, this.chart.element);
      }
      const edges = answer.position_mm.flatMap((position, model) => {
        const band = answer.band_mm[model];
        return [-1, 1].map((sign) => position.map((value, at): number | null => (band ? value + sign * band[at]! : null)));
      });
      this.chart.show(answer.time_s, ...answer.position_mm, ...edges);
      say(this.words, this.apart(alive, answer));
    } catch (error) {
      say(this.words, error instanceof Refused ? error.message : String(error));
    }
  }

  /** By how much the first model and each other one part, when, and whether that is more than what is open about both. */
  private apart(alive: Alive[], { time_s, position_mm, band_mm }: Prediction): string {
    const [first] = alive;
    const parts = alive.slice(1).map((one, index) => {
      const gaps = time_s.map((_, at) => Math.abs(position_mm[0]![at]! - position_mm[index + 1]![at]!));
      const most = Math.max(...gaps);
      const at = gaps.indexOf(most);
      const open = Math.hypot(band_mm[0]?.[at] ?? 0, band_mm[index + 1]?.[at] ?? 0);
      return `${one.name} at most ${fixed(most, 3)} mm away, at ${fixed(time_s[at], 2)} s (${open > most ? "within" : "beyond"} the ${fixed(open, 3)} mm that is open)`;
    });
    const noise = this.explain.answer?.noise_mm;
    return parts.length === 0 ? "" : `From ${first!.name}: ${parts.join("; ")}.${noise ? ` The noise is ${fixed(noise, 3)} mm.` : ""}`;
  }

  private controls(): void {
    const { plan } = this;
    const ambient_kpa = this.lab.runs[0]!.supply_kpa - this.lab.runs[0]!.supply_kpa_gauge;
    const number = (label: string, unit: string, value: number, step: number, take: (value: number) => void) => {
      const input = h("input", { type: "number", value: round(value), step, min: 0, "aria-label": `${label} in ${unit}`, oninput: () => {
        if (Number.isFinite(input.valueAsNumber)) {
          take(input.valueAsNumber);
          this.draw_pattern();
          this.changed();
        }
      } });
      return h("label", {}, `${label} `, input, ` ${unit}`);
    };
    fill(this.conditions,
      number("supply over ambient", "kPa", plan.supply_pressure_pa / 1e3 - ambient_kpa, 10, (value) => { plan.supply_pressure_pa = 1e3 * (value + ambient_kpa); }),
      number("temperature", "K", plan.temperature_k, 1, (value) => { plan.temperature_k = value; }),
      number("leak to atmosphere", "mm²", 1e6 * plan.leak_to_atmosphere_m2, 0.02, (value) => { plan.leak_to_atmosphere_m2 = 1e-6 * value; }),
      number("leak from supply", "mm²", 1e6 * plan.leak_from_supply_m2, 0.02, (value) => { plan.leak_from_supply_m2 = 1e-6 * value; }),
      number("end", "s", plan.end_s, 0.5, (value) => { plan.end_s = value; }));
    this.draw_pattern();
    this.changed();
  }

  /** The commands as a line that is drawn with the hand: edges are dragged or moved by keys, a double click adds or takes one. */
  private draw_pattern(): void {
    const { plan } = this;
    const track = h("div", { class: "track-line", title: "double-click to add or take away a command" });
    const share = (time: number) => `${(100 * time) / plan.end_s}%`;
    const sorted = () => {
      plan.commands.sort((a, b) => a.at_s - b.at_s);
      plan.commands.forEach((edge, index) => { edge.close = index % 2 === 0; });
    };
    const at = (event: MouseEvent) => {
      const box = track.getBoundingClientRect();
      return round(Math.min(0.99, Math.max(0, (event.clientX - box.left) / box.width)) * plan.end_s);
    };
    const changed = () => { sorted(); this.draw_pattern(); this.changed(); };
    track.addEventListener("dblclick", (event) => { plan.commands.push({ at_s: at(event), close: true }); changed(); });
    plan.commands.forEach((edge, index) => {
      const until = plan.commands[index + 1]?.at_s ?? plan.end_s;
      const bar = h("span", { class: edge.close ? "closes" : "opens" }, edge.close ? "close" : "open");
      bar.style.left = share(edge.at_s);
      bar.style.width = share(Math.max(0, until - edge.at_s));
      const handle = h("button", { type: "button", class: "edge", role: "slider", "aria-label": `${edge.close ? "close" : "open"} command`,
        "aria-valuemin": 0, "aria-valuemax": plan.end_s, "aria-valuenow": edge.at_s, "aria-valuetext": `${fixed(edge.at_s, 2)} s` });
      handle.style.left = share(edge.at_s);
      handle.addEventListener("pointerdown", (down) => {
        down.preventDefault();
        handle.focus();
        const move = (event: PointerEvent) => {
          const lower = (plan.commands[index - 1]?.at_s ?? -0.02) + 0.02;
          const upper = (plan.commands[index + 1]?.at_s ?? plan.end_s) - 0.02;
          edge.at_s = round(Math.min(upper, Math.max(lower, at(event))));
          handle.style.left = share(edge.at_s);
          bar.style.left = share(edge.at_s);
          this.changed();
        };
        const up = () => {
          removeEventListener("pointermove", move);
          removeEventListener("pointerup", up);
          changed();
        };
        addEventListener("pointermove", move);
        addEventListener("pointerup", up);
      });
      handle.addEventListener("dblclick", (event) => {
        event.stopPropagation();
        if (plan.commands.length > 1) plan.commands.splice(index, 1);
        changed();
      });
      handle.addEventListener("keydown", (event) => {
        const step = { ArrowLeft: -0.05, ArrowRight: 0.05 }[event.key];
        if (event.key === "Delete" && plan.commands.length > 1) plan.commands.splice(index, 1);
        else if (step !== undefined) edge.at_s = round(Math.min(plan.end_s - 0.02, Math.max(0, edge.at_s + step)));
        else return;
        event.preventDefault();
        changed();
        (this.pattern.querySelectorAll(".edge")[index] as HTMLElement | undefined)?.focus();
      });
      track.append(bar, handle);
    });
    fill(this.pattern, h("span", { class: "pattern-label" }, "commands"), track,
      h("button", { type: "button", onclick: () => {
        const last = plan.commands[plan.commands.length - 1]?.at_s ?? 0;
        plan.commands.push({ at_s: round(0.5 * (last + plan.end_s)), close: true });
        changed();
      } }, "add"),
      h("button", { type: "button", disabled: plan.commands.length < 2, onclick: () => { plan.commands.pop(); changed(); } }, "take away"));
  }

  private as_toml(): string {
    const { plan } = this;
    const leaks = ([["leak_to_atmosphere", plan.leak_to_atmosphere_m2], ["leak_from_supply", plan.leak_from_supply_m2]] as const)
      .filter(([, area]) => area > 0).map(([key, area]) => `${key} = "${round(1e6 * area)} mm2"\n`);
    const commands = plan.commands.map((edge) => `{ at = "${edge.at_s} s", close = ${edge.close} }`);
    return `[[run]]\nsupply_pressure = "${round(1e-3 * plan.supply_pressure_pa)} kPa"\ntemperature = "${round(plan.temperature_k)} K"\n${leaks.join("")}commands = [ ${commands.join(", ")} ]\nend = "${plan.end_s} s"\n`;
  }
}

const round = (value: number): number => Number(value.toFixed(3));
