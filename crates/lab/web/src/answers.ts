/** What fits and searches answer, as tables. */

import type { FittedParameter, Step } from "./api";
import { h, table } from "./dom";
import { digits, fixed, pretty } from "./numbers";

const HANDY: Record<string, [number, string]> = { m: [1e3, "mm"], m2: [1e6, "mm2"], m3: [1e6, "cm3"], s: [1e3, "ms"], Pa: [1e-3, "kPa"] };

/** An SI value with its standard error in the unit that people read it in. */
export function with_error(value: number, error: number, si: string): string {
  const [factor, unit] = HANDY[si] ?? [1, si];
  return `${digits(value * factor)} ± ${digits(error * factor, 2)} ${pretty(unit)}`.trim();
}

export function parameter_list(parameters: FittedParameter[]): HTMLElement {
  return h("ul", {}, ...parameters.map((one) =>
    h("li", {}, `${one.effect}: ${one.name.replaceAll("_", " ")} = ${with_error(one.value, one.standard_error, one.unit)}`)));
}

/** The error after each step. */
export function step_table(steps: Step[]): HTMLElement {
  const traces = steps.some((step) => step.rmse_m !== null);
  const scaled = (value: number | null) => fixed(value === null ? null : 1e3 * value, traces ? 4 : 3);
  return table("the error after each step",
    ["step", traces ? "error (mm)" : "error (ms)", ...(traces ? ["held out (mm)"] : []), "in noise", "held out"],
    steps.map((step) => [step.step, scaled(traces ? step.rmse_m : step.time_rmse_s), ...(traces ? [scaled(step.held_out_rmse_m)] : []),
      fixed(step.normalised_rms, 3), fixed(step.held_out_normalised_rms, 3)]));
}
