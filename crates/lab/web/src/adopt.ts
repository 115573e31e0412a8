/** Adopt: the sliders' model as a valve file, with what changes in it. */

import { api, Refused, type Lives, type Preview } from "./api";
import { fill, h, say, table } from "./dom";
import { fixed } from "./numbers";
import type { Sliders } from "./sliders";

/** Lines about a change that are shown. */
const AROUND = 2;

export class Adopt {
  readonly element = h("section", { "aria-labelledby": "adopt-title" });
  private readonly diff = h("div", {});
  private readonly path = h("input", { type: "text", id: "adopt-path", size: 48, spellcheck: "false" });
  private readonly replace = h("input", { type: "checkbox", id: "adopt-replace" });
  private readonly ask = h("p", { hidden: true }, this.replace, h("label", { for: "adopt-replace" }, " replace the file that is there"));
  private readonly button = h("button", { type: "button", class: "strong", id: "adopt-write" }, "write the file");
  private readonly status = h("p", { role: "status", class: "adopt-status" });
  private readonly life = h("div", { class: "life", role: "status" });
  private readonly ask_life = h("button", { type: "button", id: "adopt-life", onclick: () => void this.tell_life() }, "what it does to the remaining life");
  private readonly life_place = h("div", { hidden: true }, h("h3", {}, "The remaining life by the log"), h("p", {}, this.ask_life), this.life);
  private is_seen = false;
  private is_named = false;
  private timer = 0;

  constructor(private readonly sliders: Sliders) {
    this.path.addEventListener("input", () => { this.is_named = true; this.ask.hidden = true; this.replace.checked = false; });
    this.button.addEventListener("click", () => void this.write());
    this.element.append(h("h2", { id: "adopt-title" }, "The valve file with this model"),
      h("p", {}, "What the sliders say, in the units and with the comments of your file; the step is kept in its history, so that ", h("code", {}, "valve revert"), " goes back."),
      this.diff,
      h("p", {}, h("label", { for: this.path.id }, "write to "), this.path, " ", this.button), this.ask, this.status, this.life_place);
  }

  begin(has_log: boolean): void {
    this.life_place.hidden = !has_log;
  }

  changed(): void {
    // What was told was told of other sliders.
    fill(this.life);
    clearTimeout(this.timer);
    this.timer = setTimeout(() => { if (this.is_seen) void this.renew(); }, 250) as unknown as number;
  }

  seen(is_seen: boolean): void {
    this.is_seen = is_seen;
    if (is_seen) void this.renew();
  }

  private async renew(): Promise<void> {
    try {
      this.show(await api.preview(this.sliders.model()));
    } catch (error) {
      fill(this.diff, h("p", { class: "notice bad" }, error instanceof Refused ? error.message : String(error)));
    }
  }

  private async tell_life(): Promise<void> {
    this.ask_life.disabled = true;
    fill(this.life, "building the tables of both models and reading the log…");
    const model = this.sliders.model();
    try {
      const lives = await api.lives(model);
      if (JSON.stringify(model) === JSON.stringify(this.sliders.model())) fill(this.life, life_table(lives));
    } catch (error) {
      fill(this.life, error instanceof Refused ? error.message : String(error));
    }
    this.ask_life.disabled = false;
  }

  private show(preview: Preview): void {
    if (!this.is_named) this.path.value = preview.path;
    this.button.disabled = !preview.changes;
    if (!preview.changes) {
      fill(this.diff, h("p", { class: "notice" }, "The sliders say what the valve file says: nothing to write. Switch an effect on, or fit."));
      return;
    }
    const near = (index: number) => preview.diff.slice(Math.max(0, index - AROUND), index + AROUND + 1).some(([sign]) => sign !== " ");
    const lines: HTMLElement[] = [];
    let skipped = false;
    preview.diff.forEach(([sign, text], index) => {
      if (!near(index)) {
        if (!skipped) lines.push(h("span", { class: "gap" }, "⋯"));
        skipped = true;
        return;
      }
      skipped = false;
      const kind = sign === "+" ? "added" : sign === "-" ? "removed" : "kept";
      lines.push(h("span", { class: kind }, `${sign} ${text}`));
    });
    fill(this.diff, h("pre", { class: "diff", tabindex: 0, "aria-label": "changes of the valve file, + added, - removed" }, ...lines));
  }

  private async write(): Promise<void> {
    const path = this.path.value;
    try {
      const answer = await api.write(this.sliders.model(), path, this.replace.checked);
      if ("exists" in answer) {
        this.ask.hidden = false;
        say(this.status, `${answer.exists} exists already: choose another name, or say that it may be replaced.`);
        return;
      }
      const { written } = answer;
      this.ask.hidden = true;
      this.replace.checked = false;
      this.is_named = false;
      fill(this.status, `Written: ${written}. Next: `, h("code", {}, `valve build-tables ${written} --out tables`));
      this.status.dataset["written"] = written;
    } catch (error) {
      say(this.status, error instanceof Refused ? error.message : String(error));
    }
  }
}

function life_table(lives: Lives): HTMLElement {
  const told = (model: Lives["models"][number], row: number): string => {
    const one = model.told?.[row];
    if (!one) return "no tables";
    if (one.eol_cycle === null) return "no fault named";
    return fixed(one.eol_cycle, 1) + (one.eol_bounds ? ` (${one.eol_bounds.map((bound) => fixed(bound, 1)).join(" to ")})` : "");
  };
  const rows = lives.after_cycles.map((cycle, row) => [String(cycle), ...lives.models.map((model) => told(model, row))]);
  const failed = lives.models.filter((model) => model.no_tables);
  return h("div", {}, h("p", {}, `End of life of ${lives.valve}: cycle, 5 to 95 %.`),
    table("end of life with each model", ["after cycle", ...lives.models.map((model) => model.model)], rows),
    ...failed.map((model) => h("p", { class: "notice" }, `${model.model}: no tables, ${model.no_tables}`)));
}
