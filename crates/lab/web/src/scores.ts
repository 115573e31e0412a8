/** The error: in one line at the top, by run, by phase, in words. */

import type { Comparison, Description, PhaseScore } from "./api";
import { fill, h, say, table } from "./dom";
import { digits, fixed, signed } from "./numbers";

const PHASES: [string, string][] = [["dead_time", "dead time"], ["breakaway", "breakaway"], ["travel", "travel"], ["seating", "seating"]];

/** Time after which tables follow, ms. */
const TABLES = 120;

const ms = (seconds: number | null | undefined): string => signed(seconds === null || seconds === undefined ? seconds : 1e3 * seconds, 1);
const mm = (metres: number | null | undefined): string => fixed(metres === null || metres === undefined ? metres : 1e3 * metres, 3);

export class Scores {
  readonly element = h("section", { class: "scores", "aria-labelledby": "scores-title" });
  /** The error in one line, for the head of the page. */
  readonly head = h("div", { class: "error-line" });
  private readonly value = h("strong", { class: "error-now", "data-error": "" });
  private readonly noise = h("span", { class: "error-noise" });
  private readonly against = h("span", { class: "error-before" });
  private readonly meter = h("span", { class: "meter", "aria-hidden": "true" }, h("span", {}));
  private readonly words = h("ul", { class: "words" });
  private readonly runs = h("div", {});
  private readonly phases = h("div", {});
  private before: Comparison | null = null;
  private newest: Comparison | null = null;
  private timer = 0;
  private lab!: Description;

  constructor() {
    this.head.append(h("span", { class: "label" }, "error"), this.value, this.noise, this.meter, this.against);
    this.element.append(
      h("h2", { id: "scores-title" }, "Where the model is off"), this.words,
      h("h3", {}, "By phase of a stroke"), this.phases,
      h("h3", {}, "By run"), this.runs);
  }

  begin(lab: Description, before: Comparison): void {
    this.lab = lab;
    this.before = before;
  }

  show(now: Comparison): void {
    const before = this.before!;
    const { overall } = now;
    const in_mm = overall.rmse_m !== null;
    say(this.value, in_mm ? `${mm(overall.rmse_m)} mm` : `${digits(overall.normalised_rms, 3)} × noise`);
    this.value.dataset["error"] = String(overall.normalised_rms);
    say(this.noise, in_mm ? `${digits(overall.normalised_rms, 3)} times the noise` : `of the stroke times (${overall.noise_source})`);
    const changed = Math.abs(before.overall.normalised_rms - overall.normalised_rms) > 1e-9;
    const was = in_mm ? `${mm(before.overall.rmse_m)} mm` : `${digits(before.overall.normalised_rms, 3)} × noise`;
    say(this.against, changed ? `was ${was} with the valve file` : "the valve file as it is");
    // From the noise at the left to the file's error at the right.
    const worst = Math.max(before.overall.normalised_rms, overall.normalised_rms, 1.5);
    const share = Math.log(Math.max(overall.normalised_rms, 1)) / Math.log(worst);
    (this.meter.firstElementChild as HTMLElement).style.width = `${100 * Math.min(1, Math.max(0.02, share))}%`;
    this.newest = now;
    if (this.timer === 0) this.timer = setTimeout(() => this.show_tables(), TABLES) as unknown as number;
  }

  /** Tables are many elements: while a hand moves they follow a few times a second, after the charts. */
  private show_tables(): void {
    this.timer = 0;
    const now = this.newest!;
    fill(this.words, ...now.words.map((text) => h("li", {}, text)));
    fill(this.runs, this.run_table(now));
    fill(this.phases, this.phase_table(now));
  }

  private run_table(now: Comparison): HTMLElement {
    const row = (name: string, of: Comparison["overall"] | Comparison["runs"][number], was: { normalised_rms: number }, supply: string) => [
      name, supply, mm(of.rmse_m), digits(of.normalised_rms, 3), digits(was.normalised_rms, 3), ms(of.close_time_error_s), ms(of.open_time_error_s),
    ];
    const rows = now.runs.map((run, index) =>
      row(run.file, run, this.before!.runs[index] ?? run, digits(this.lab.runs[index]?.supply_kpa, 3)));
    rows.push(row("all", now.overall, this.before!.overall, ""));
    return table("error of every run", ["run", "supply (kPa)", "error (mm)", "in noise", "valve file", "closing (ms)", "opening (ms)"], rows);
  }

  private phase_table(now: Comparison): HTMLElement | null {
    const { closing, opening } = now.overall.phases;
    if (!closing || !opening) return h("p", {}, "Stroke times alone know no phases.");
    const cells = (score: PhaseScore | undefined) => [mm(score?.rmse_m), fixed(score?.share, 3), ms(score?.time_error_s)];
    return table("error by phase", ["phase", "closing (mm)", "share", "off by (ms)", "opening (mm)", "share", "off by (ms)"],
      PHASES.map(([id, name]) => [name, ...cells(closing[id]), ...cells(opening[id])]));
  }
}
