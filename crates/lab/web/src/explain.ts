/** Explain: the search for what is missing, live; then the answer, with bars to click on. */

import { api, Refused, type Candidate, type ExplainAnswer, type LabEvent, type Model, type PlannedRun, type Twins } from "./api";
import { parameter_list, step_table, with_error } from "./answers";
import { Chart } from "./charts";
import { fill, h, say } from "./dom";
import { digits, fixed, percent } from "./numbers";
import type { Sliders } from "./sliders";

/** Candidates that are shown. */
const MOST = 14;

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

  take(answer: ExplainAnswer | undefined, version: number): void {
    if (!answer || answer.job === this.known) return;
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
    this.show(answer);
    this.listeners.forEach((listener) => listener());
  }

  private show(answer: ExplainAnswer): void {
    const { document: found } = answer;
    const is_best = found.recommended.length > 0;
    fill(this.body,
      h("p", { class: "headline", "data-verdict": found.verdict }, answer.headline),
      found.parameters.length > 0 && parameter_list(found.parameters),
      is_best && h("p", {}, h("button", { type: "button", class: "strong", id: "put-answer", onclick: () => this.sliders.put(answer.model) }, "put the answer on the sliders")),
      step_table(found.steps),
      h("p", { class: "aside" }, "Errors here are of rows that follow the motion, as valve explain tells them, what instruments are off by taken out; the head of the page counts every sample, as valve compare does."),
      found.nuisances.length > 0 && h("details", {}, h("summary", {}, "instruments and conditions were found to be off"),
        h("ul", {}, ...found.nuisances.map((one) => h("li", {}, `${one.what}${one.run ? ` (${one.run})` : ""}: ${one.unit === "" ? `${digits(100 * one.value, 3)} ± ${digits(100 * one.standard_error, 2)} %` : with_error(one.value, one.standard_error, one.unit)}${one.at_bound ? ", at its bound: something may be missing" : ""}`)))),
      ...found.notes.map((note) => h("p", { class: "notice" }, note)),
      h("h3", {}, "Candidates"),
      h("p", {}, "How likely each set of effects is, and the error that it leaves. Click on one to put it on the sliders."),
      this.bars(found.candidates),
      ...answer.twins.map((twins) => this.twins(twins)),
      found.residual && h("div", {}, h("h3", {}, "Outside the catalogue"),
        h("p", {}, `What is missing acts as ${found.residual.acts_on} along ${found.residual.along}: ${found.residual.custom.formula}. Paste it into the valve file:`),
        h("pre", {}, found.residual.toml)));
  }

  private bars(candidates: Candidate[]): HTMLElement {
    // A set that was fitted both cheaply and finely is told once, as the better fit has it.
    const name_of = (one: Candidate) => one.effects.join();
    const shown = candidates.filter((one, index) => candidates.findIndex((other) => name_of(other) === name_of(one)) === index).slice(0, MOST);
    const worst = Math.max(...shown.map((one) => one.normalised_rms), 1.5);
    // Errors from the noise on, by their logarithm: that is what a fit gains.
    const share = (error: number) => Math.max(0.01, Math.log(Math.max(error, 1)) / Math.log(worst));
    const bar = (kind: string, size: number, text: string) => {
      const inside = h("span", {});
      inside.style.width = `${100 * Math.min(1, size)}%`;
      return h("span", { class: `measure ${kind}` }, h("span", { class: "track" }, inside), h("span", { class: "text" }, text));
    };
    return h("div", { class: "candidates", role: "list" },
      h("div", { class: "candidate heads", "aria-hidden": "true" }, h("span", {}, "effects"), h("span", {}, "probability"), h("span", {}, "error that is left"), h("span", {}, "")),
      ...shown.map((one) => {
        const name = one.effects.join(" + ") || "nothing (calibrated)";
        const error = one.rmse_m === null ? `${digits(one.normalised_rms, 3)} × noise` : `${fixed(1e3 * one.rmse_m, 3)} mm, ${digits(one.normalised_rms, 3)} × noise`;
        return h("div", { role: "listitem" },
          h("button", { type: "button", class: `candidate${one.rejected === null ? " chosen" : ""}`, "data-candidate": one.effects.join("+"),
            onclick: () => this.sliders.put_effects(one.effects, one.parameters) },
            h("span", { class: "name" }, name),
            one.probability === null ? h("span", { class: "measure" }, "not fitted to the end") : bar("probability", one.probability, percent(one.probability)),
            bar("left", share(one.normalised_rms), error),
            h("span", { class: "why" }, one.rejected === null ? "✓ chosen" : one.rejected)));
      }));
  }

  private twins(twins: Twins): HTMLElement {
    if (twins.with.length === 0) {
      return h("p", {}, `${twins.effect}: no other effect explains these strokes as well.`);
    }
    const put = (model: Model) => () => this.sliders.put(model);
    const plan = twins.experiment;
    const element = h("div", { class: "twins" },
      h("h3", {}, `${twins.effect} cannot be told from`),
      ...twins.with.map((twin) => h("div", {},
        h("button", { type: "button", onclick: put(twin.model) }, twin.effect),
        ` log evidence ${fixed(-twin.behind, 1)} nats `, parameter_list(twin.parameters))));
    if (plan) {
      const chart = new Chart({
        title: `next experiment: ${plan.purpose}`, height: 220, x: "time (s)", y: "position (mm)",
        lines: [{ label: twins.effect, colour: "model", width: 2 }, { label: twins.with[0]!.effect, colour: "before", width: 2, dash: [6, 4] }],
      });
      element.append(
        h("h3", {}, `${plan.decides ? "What would tell them apart" : "What would help most"}: ${plan.purpose}`),
        h("p", {}, `Expected difference of chi-squared ${fixed(plan.separation, 0)}${plan.repeats > 1 ? `, ${plan.repeats} strokes` : ""}${plan.pressures ? ", with the pressures recorded too" : ""}.`),
        chart.element,
        h("pre", {}, plan.toml),
        h("button", { type: "button", onclick: () => this.plan(plan.plan) }, "try variations of it"));
      // Drawn once it has a width.
      requestAnimationFrame(() => chart.show(plan.time_s, plan.position_mm[0] ?? [], plan.position_mm[1] ?? []));
    }
    return element;
  }

  /** What the experiment's part does with a plan. */
  plan: (plan: PlannedRun) => void = () => undefined;

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
