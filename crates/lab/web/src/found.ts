/** What a search has found: the verdict, the candidates as bars, twins, the next experiment. */

import type { Candidate, Found, Model, PlannedRun, Twins } from "./api";
import { parameter_list, step_table, with_error } from "./answers";
import { Chart } from "./charts";
import { h } from "./dom";
import { digits, fixed, percent } from "./numbers";

/** Candidates that are shown. */
const MOST = 12;

/** What a click does where there are sliders. */
export interface Acts {
  put: (model: Model) => void;
  put_effects: (effects: string[], values: { effect: string; name: string; value: number | null }[]) => void;
  plan: (plan: PlannedRun) => void;
  /** Shows the strokes of a run. */
  run: (name: string) => void;
}

/** An answer; what can be put on sliders can be clicked on, where there are any. */
export function found_view(answer: Found, acts: Acts | null): HTMLElement {
  const { document: found } = answer;
  const is_best = found.recommended.length > 0;
  // The first note is then of the run that was left out.
  const { left_out } = found;
  const [slip, notes] = left_out ? [found.notes[0], found.notes.slice(1)] : [undefined, found.notes];
  return h("div", {},
    h("p", { class: "headline", "data-verdict": found.verdict }, answer.headline),
    left_out && h("p", { class: "notice bad", "data-left-out": left_out.run }, slip, acts && " ",
      acts && h("button", { type: "button", onclick: () => acts.run(left_out.run) }, "show this run")),
    found.parameters.length > 0 && parameter_list(found.parameters),
    is_best && acts && h("p", {}, h("button", { type: "button", class: "strong", id: "put-answer", onclick: () => acts.put(answer.model) }, "put the answer on the sliders")),
    step_table(found.steps),
    h("p", { class: "aside" }, "Errors here are of rows that follow the motion, as valve explain tells them, what instruments are off by taken out; the error beside the strokes counts every sample, as valve compare does."),
    found.nuisances.length > 0 && h("details", {}, h("summary", {}, "instruments and conditions were found to be off"),
      h("ul", {}, ...found.nuisances.map((one) => h("li", {}, `${one.what}${one.run ? ` (${one.run})` : ""}: ${one.unit === "" ? `${digits(100 * one.value, 3)} ± ${digits(100 * one.standard_error, 2)} %` : with_error(one.value, one.standard_error, one.unit)}${one.at_bound ? ", at its bound: something may be missing" : ""}`)))),
    ...notes.map((note) => h("p", { class: "notice" }, note)),
    h("h3", {}, "Candidates"),
    h("p", {}, `${found.verdict === "adequate" ? "None of these is needed: how likely each would be if something were missing," : "How likely each set of effects is,"} and the error that it leaves.${acts ? " Click on one to put it on the sliders." : ""}`),
    bars(found.candidates, acts),
    ...answer.twins.map((twins) => twins_view(twins, acts)),
    found.residual && h("div", {}, h("h3", {}, "Outside the catalogue"),
      h("p", {}, `What is missing acts as ${found.residual.acts_on} along ${found.residual.along}: ${found.residual.custom.formula}. Paste it into the valve file:`),
      h("pre", {}, found.residual.toml)));
}

function bars(candidates: Candidate[], acts: Acts | null): HTMLElement {
  // A set that was fitted both cheaply and finely is told once, as the better fit has it.
  const name_of = (one: Candidate) => one.effects.join();
  const shown = candidates.filter((one, index) => candidates.findIndex((other) => name_of(other) === name_of(one)) === index).filter((one, place) => place < MOST || one.rejected === null);
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
      const cells = [
        h("span", { class: "name" }, name),
        one.probability === null ? h("span", { class: "measure" }, "not fitted to the end") : bar("probability", one.probability, percent(one.probability)),
        bar("left", share(one.normalised_rms), error),
        h("span", { class: "why" }, one.rejected === null ? "✓ chosen" : one.rejected),
      ];
      const what = { class: `candidate${one.rejected === null ? " chosen" : ""}`, "data-candidate": one.effects.join("+") };
      return h("div", { role: "listitem" }, acts
        ? h("button", { type: "button", ...what, onclick: () => acts.put_effects(one.effects, one.parameters) }, ...cells)
        : h("div", what, ...cells));
    }));
}

function twins_view(twins: Twins, acts: Acts | null): HTMLElement {
  if (twins.with.length === 0) {
    return h("p", {}, `${twins.effect}: of the effects known here no other explains these strokes as well.`);
  }
  const plan = twins.experiment;
  const element = h("div", { class: "twins" },
    h("h3", {}, `${twins.effect} cannot be told from`),
    ...twins.with.map((twin) => h("div", {},
      acts ? h("button", { type: "button", onclick: () => acts.put(twin.model) }, twin.effect) : h("strong", {}, twin.effect),
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
      acts ? h("button", { type: "button", onclick: () => acts.plan(plan.plan) }, "try variations of it") : "");
    // Drawn once it has a width.
    requestAnimationFrame(() => chart.show(plan.time_s, plan.position_mm[0] ?? [], plan.position_mm[1] ?? []));
  }
  return element;
}
