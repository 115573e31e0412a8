/** "Fit this": the effects that are on and the tolerated parameters, refitted by the program. */

import { api, Refused, type FitAnswer } from "./api";
import { fill, h, say } from "./dom";
import { digits } from "./numbers";
import type { Sliders } from "./sliders";
import { parameter_list, step_table } from "./answers";

export class Fit {
  readonly element = h("section", { class: "fit", "aria-labelledby": "fit-title", hidden: true });
  private readonly status = h("p", { role: "status" });
  private readonly body = h("div", {});
  private known = 0;
  private runs = false;
  private timer = 0;

  constructor(private readonly sliders: Sliders, private readonly button: HTMLButtonElement) {
    this.element.append(h("h2", { id: "fit-title" }, "Last fit"), this.status, this.body);
    button.addEventListener("click", () => void this.act());
  }

  /** The program was started anew and counts its jobs from one again. */
  forget(): void {
    this.known = 0;
  }

  /** Shows an answer; the sliders go where a fit that just ended has them. */
  take(answer: FitAnswer | undefined, version: number, is_new = false): void {
    if (!answer) return;
    if (answer.job === this.known) {
      if (answer.version !== version && answer.error === undefined) say(this.status, "The files have changed since this fit.");
      return;
    }
    this.known = answer.job;
    this.element.hidden = false;
    if (answer.error !== undefined) {
      say(this.status, answer.error);
      fill(this.body);
      return;
    }
    if (answer.version !== version) return;
    if (is_new) this.sliders.put(answer.model);
    say(this.status, `${answer.headline} (${answer.how}; ${digits(answer.seconds, 2)} s)`);
    fill(this.body,
      answer.calibration && h("ul", {}, ...answer.calibration.reasons.map((reason) => h("li", {}, reason))),
      answer.parameters && parameter_list(answer.parameters),
      answer.steps && step_table(answer.steps),
      h("button", { type: "button", onclick: () => this.sliders.put(answer.model) }, "put it on the sliders"));
  }

  /** Since how many seconds a fit runs, or that none does. */
  running(seconds: number | null): void {
    this.runs = seconds !== null;
    clearInterval(this.timer);
    this.button.textContent = this.runs ? "stop" : "fit this";
    this.button.setAttribute("aria-busy", String(this.runs));
    if (seconds === null) return;
    this.element.hidden = false;
    const start = performance.now() - 1e3 * seconds;
    const tick = () => say(this.status, `fitting, ${Math.floor((performance.now() - start) / 1e3)} s`);
    tick();
    this.timer = setInterval(tick, 1000) as unknown as number;
  }

  private async act(): Promise<void> {
    try {
      if (this.runs) await api.stop();
      else await api.fit(this.sliders.model());
    } catch (error) {
      this.element.hidden = false;
      say(this.status, error instanceof Refused ? error.message : String(error));
    }
  }
}
