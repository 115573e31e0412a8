/** Explain: the search for what is missing, live; then the answer, with bars to click on. */

import { api, Refused, type ExplainAnswer, type LabEvent, type LeftOut, type PlannedRun } from "./api";
import { Chart } from "./charts";
import { fill, h, say } from "./dom";
import { found_view } from "./found";
import { digits, fixed } from "./numbers";
import type { Sliders } from "./sliders";

export class Explain {
  readonly element = h("section", { class: "explain", "aria-labelledby": "explain-title" });
  private readonly button = h("button", { type: "button", class: "strong", id: "explain-go" }, "look for what is missing");
  private readonly status = h("p", { role: "status", class: "explain-status" });
  private readonly live = h("div", { class: "live", hidden: true });
  private readonly body = h("div", {});
  private chart: Chart | null = null;
  private tried: { sets: number[]; errors: number[]; best: number[] } = { sets: [], errors: [], best: [] };
  private readonly latest = h("p", { class: "latest" });
  private readonly reached = h("ol", { class: "reached" });
  private known = 0;
  private runs = false;
  private timer = 0;
  private start = 0;
  private drawing = false;
  /** The last answer, for the page's other parts. */
  answer: ExplainAnswer | null = null;
  private listeners: (() => void)[] = [];

  constructor(private readonly sliders: Sliders) {
    this.element.append(
      h("h2", { id: "explain-title" }, "What is missing"),
      h("p", {}, "Tries every effect of the catalogue on the valve file's model, and pairs of them, everything refitted each time. The same as ", h("code", {}, "valve explain"), "."),
      h("div", { class: "bar" }, this.button), this.status, this.live, this.body);
    this.button.addEventListener("click", () => void this.act());
  }

  get is_idle(): boolean {
    return !this.runs && this.answer === null;
  }

  /** Starts the search, as the button does. */
  go(): void {
    if (!this.runs) void this.act();
    this.element.scrollIntoView({ block: "nearest" });
  }

  listen(listener: () => void): void {
    this.listeners.push(listener);
  }

  running(seconds: number | null): void {
    const began = seconds !== null && !this.runs;
    this.runs = seconds !== null;
    clearInterval(this.timer);
    this.button.textContent = this.runs ? "stop" : "look for what is missing";
    this.live.hidden = !this.runs;
    if (seconds === null) return;
    if (began) {
      this.tried = { sets: [], errors: [], best: [] };
      fill(this.reached);
      fill(this.body);
      say(this.latest, "");
      this.chart?.remove();
      this.chart = new Chart({
        title: "error of each set tried, and the least so far", height: 170, x: "sets tried", y: "error (× noise)", logarithmic: true,
        lines: [{ label: "tried", colour: "before", width: 1, points: true }, { label: "least so far", colour: "model", width: 2 }],
      });
      fill(this.live, this.chart.element, this.latest, this.reached);
    }
    this.start = performance.now() - 1e3 * seconds;
    this.tick();
    this.timer = setInterval(() => this.tick(), 1000) as unknown as number;
  }

  private tick(): void {
    const seconds = Math.floor((performance.now() - this.start) / 1e3);
    say(this.status, `searching, ${seconds} s, ${this.tried.sets.length} sets tried`);
  }

  progress(event: LabEvent): void {
    if (event.event === "tried") {
      const { sets, errors, best } = this.tried;
      sets.push(sets.length + 1);
      errors.push(event.error);
      best.push(Math.min(event.error, best[best.length - 1] ?? Number.POSITIVE_INFINITY));
      say(this.latest, `${event.effects.join(" + ") || "the calibrated model"}: ${digits(event.error, 3)} times the noise`);
      this.element.dataset["tried"] = String(sets.length);
      if (!this.drawing) {
        this.drawing = true;
        // News come faster than pictures.
        setTimeout(() => {
          this.drawing = false;
          this.chart?.show(this.tried.sets, this.tried.errors, this.tried.best);
        }, 100);
      }
    } else if (event.event === "reached") {
      this.reached.append(h("li", {}, `${event.effects.join(" + ")} gains ${fixed(event.gain, 0)} nats of evidence; looking further`));
    } else if (event.event === "doing") {
      say(this.latest, event.what);
    }
  }

  /** The program was started anew and counts its jobs from one again. */
  forget(): void {
    this.known = 0;
  }

  take(answer: ExplainAnswer | undefined, version: number): void {
    if (!answer) return;
    if (answer.job === this.known) {
      if (answer.version !== version && answer.error === undefined) say(this.status, "The files have changed since this search: look again.");
      return;
    }
    this.known = answer.job;
    if (answer.error !== undefined) {
      say(this.status, answer.error);
      return;
    }
    if (answer.version !== version) {
      say(this.status, "The files have changed since the last search.");
      return;
    }
    this.answer = answer;
    say(this.status, `found in ${digits(answer.seconds, 2)} s${answer.document.interrupted ? ", stopped early" : ""}`);
    fill(this.body, found_view(answer, {
      put: (model) => this.sliders.put(model),
      put_effects: (effects, values) => this.sliders.put_effects(effects, values),
      plan: (plan) => this.plan(plan),
      run: (name) => this.show_run(name),
    }));
    this.listeners.forEach((listener) => listener());
  }

  /** What the experiment's part does with a plan. */
  plan: (plan: PlannedRun) => void = () => undefined;

  /** Shows the strokes of a run. */
  show_run: (name: string) => void = () => undefined;

  /** The run that the search has left out, if its answer is of these files. */
  left_out(version: number): LeftOut | null {
    return this.answer?.version === version ? this.answer.document.left_out : null;
  }

  private async act(): Promise<void> {
    try {
      if (this.runs) await api.stop();
      else {
        say(this.status, "starting the search");
        await api.explain();
      }
    } catch (error) {
      say(this.status, error instanceof Refused ? error.message : String(error));
    }
  }
}
