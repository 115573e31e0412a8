/** Adopt: the sliders' model as a valve file, with what changes in it. */

import { api, Refused, type Preview } from "./api";
import { fill, h, say } from "./dom";
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
  private is_seen = false;
  private is_named = false;
  private timer = 0;

  constructor(private readonly sliders: Sliders) {
    this.path.addEventListener("input", () => { this.is_named = true; this.ask.hidden = true; this.replace.checked = false; });
    this.button.addEventListener("click", () => void this.write());
    this.element.append(h("h2", { id: "adopt-title" }, "The valve file with this model"),
      h("p", {}, "What the sliders say, in the units and with the comments of your file; the step is kept in its history, so that ", h("code", {}, "valve revert"), " goes back."),
      this.diff,
      h("p", {}, h("label", { for: this.path.id }, "write to "), this.path, " ", this.button), this.ask, this.status);
  }

  changed(): void {
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
