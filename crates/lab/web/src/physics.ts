/** Physics: the tolerated parameters as sliders, the catalogue as switches with sliders. */

import type { Description, EffectInfo, EffectParameter, Tolerated, Unit } from "./api";
import { fill, h } from "./dom";
import { digits, pretty, toSi, toUser } from "./numbers";
import type { Sliders } from "./sliders";

/** Places of a slider. */
const PLACES = 1000;

/** How a slider's place becomes a value: even where the typical value is in the middle, else so that it is. */
export class Scale {
  private readonly power: number;
  private readonly logarithmic: boolean;

  constructor(private readonly lower: number, typical: number, private readonly upper: number) {
    this.logarithmic = lower > 0 && upper / lower > 50;
    const share = (typical - lower) / (upper - lower);
    this.power = !this.logarithmic && share > 0 && share < 1 ? Math.log(share) / Math.log(0.5) : 1;
  }

  value(place: number): number {
    const share = place / PLACES;
    return this.logarithmic
      ? this.lower * (this.upper / this.lower) ** share
      : this.lower + (this.upper - this.lower) * share ** this.power;
  }

  place(value: number): number {
    const inside = Math.min(Math.max(value, this.lower), this.upper);
    const share = this.logarithmic
      ? Math.log(inside / this.lower) / Math.log(this.upper / this.lower)
      : ((inside - this.lower) / (this.upper - this.lower)) ** (1 / this.power);
    return Math.round(share * PLACES);
  }
}

interface Row {
  renew: () => void;
}

const GROUPS: [string, string][] = [
  ["mechanics", "Forces"], ["pneumatics", "Gas"], ["solenoid", "Solenoid"], ["measurement", "Recorder"], ["own", "Your own"],
];

export class Physics {
  readonly element = h("section", { class: "physics", "aria-labelledby": "physics-title" });
  readonly notice = h("p", { class: "notice bad", role: "alert", hidden: true });
  private readonly undo = h("button", { type: "button", title: "ctrl+Z", onclick: () => this.sliders.undo() }, "undo");
  private readonly redo = h("button", { type: "button", title: "ctrl+shift+Z", onclick: () => this.sliders.redo() }, "redo");
  private readonly back = h("button", { type: "button", onclick: () => this.sliders.as_in_file() }, "as in the file");
  readonly fit = h("button", { type: "button", class: "strong", title: "fits every effect that is on and every parameter with a tolerance" }, "fit this");
  private rows: Row[] = [];
  private readonly body = h("div", {});

  constructor(private readonly sliders: Sliders) {
    this.element.append(
      h("h2", { id: "physics-title" }, "Physics"),
      h("div", { class: "bar", role: "toolbar", "aria-label": "model" }, this.fit, this.undo, this.redo, this.back),
      this.notice,
      this.body,
    );
    sliders.listen(() => this.renew());
    addEventListener("keydown", (event) => {
      const typing = event.target instanceof HTMLInputElement && event.target.type !== "range" && event.target.type !== "checkbox";
      if (typing || event.key.toLowerCase() !== "z" || !(event.ctrlKey || event.metaKey)) return;
      event.preventDefault();
      if (event.shiftKey) sliders.redo();
      else sliders.undo();
    });
  }

  begin(lab: Description): void {
    this.rows = [];
    fill(this.body,
      h("h3", {}, "Effects"),
      ...GROUPS.flatMap(([part, name]) => {
        const infos = part === "own" ? lab.custom : lab.effects.filter((info) => info.acts_on === part);
        return infos.length === 0 ? [] : [h("h4", {}, name), ...infos.map((info) => this.effect(info))];
      }),
      h("h3", {}, "Parameters with a tolerance"),
      lab.parameters.length === 0
        ? h("p", {}, "None: a table [tolerance] in the valve file names what is not known exactly.")
        : h("div", {}, ...lab.parameters.map((one) => this.parameter(one))));
    this.renew();
  }

  /** Says why a model is none. */
  refuse(message: string | null): void {
    this.notice.hidden = message === null;
    this.notice.textContent = message ?? "";
  }

  private renew(): void {
    this.undo.disabled = !this.sliders.can_undo;
    this.redo.disabled = !this.sliders.can_redo;
    this.rows.forEach((row) => row.renew());
  }

  private effect(info: EffectInfo): HTMLElement {
    const toggle = h("input", { type: "checkbox", role: "switch", id: `on-${info.id}`, onchange: () => this.sliders.set_on(info, toggle.checked) });
    const shape = info.parameters.map((parameter, index) => ({ parameter, index }));
    const row = ({ parameter, index }: { parameter: EffectParameter; index: number }) => this.value(info, parameter, index);
    const refined = shape.filter(({ parameter }) => parameter.refinement);
    const body = h("div", { class: "values" },
      ...shape.filter(({ parameter }) => !parameter.refinement).map(row),
      refined.length > 0 && h("details", {}, h("summary", {}, "finer shape"), ...refined.map(row)));
    const about = h("details", { class: "about" }, h("summary", { "aria-label": `about ${info.id}` }, "about"),
      h("dl", {}, ...([["law", info.equation], ["what it does", info.symptom], ["typical sizes", info.typical_sizes],
        ["looks like", info.confused_with?.join(", ")], ["source", info.source]] as [string, string | undefined][])
        .filter(([, text]) => text).map(([name, text]) => h("div", {}, h("dt", {}, name), h("dd", {}, text)))));
    const element = h("div", { class: "effect", "data-effect": info.id },
      h("div", { class: "switch" }, toggle, h("label", { for: toggle.id }, h("strong", {}, info.id), h("span", {}, ` ${info.summary}`))),
      body, about);
    this.rows.push({
      renew: () => {
        const { on } = this.sliders.effect(info.id);
        toggle.checked = on;
        body.hidden = !on;
        element.classList.toggle("on", on);
      },
    });
    return element;
  }

  private value(info: EffectInfo, parameter: EffectParameter, index: number): HTMLElement {
    return this.slider({
      name: parameter.name.replaceAll("_", " "),
      label: `${info.id}: ${parameter.name.replaceAll("_", " ")}`,
      meaning: parameter.meaning,
      id: `${info.id}.${parameter.name}`,
      unit: parameter.unit,
      scale: new Scale(parameter.lower, parameter.typical, parameter.upper),
      read: () => this.sliders.effect(info.id).values[index] ?? Number.POSITIVE_INFINITY,
      write: (si) => this.sliders.set_value(info, index, si),
      is_on: () => this.sliders.effect(info.id).on,
    });
  }

  private parameter(one: Tolerated): HTMLElement {
    return this.slider({
      name: one.key.replaceAll("_", " ").replace(".", ": "),
      label: one.key,
      meaning: `known to ${digits(100 * one.tolerance, 2)} %, in the file ${digits(toUser(one.value, one.unit))} ${pretty(one.unit.name)}`,
      id: one.key,
      unit: one.unit,
      scale: new Scale(one.lower, one.value, one.upper),
      read: () => this.sliders.parameter(one.key),
      write: (si) => this.sliders.set_parameter(one.key, si),
      moved: () => Math.log(this.sliders.parameter(one.key) / one.value) / one.tolerance,
    });
  }

  private slider(of: {
    name: string; label: string; meaning: string; id: string; unit: Unit; scale: Scale;
    read: () => number; write: (si: number) => void; moved?: () => number; is_on?: () => boolean;
  }): HTMLElement {
    const unit = pretty(of.unit.name);
    const range = h("input", {
      type: "range", min: 0, max: PLACES, step: 1, "aria-label": of.label, title: of.meaning, "data-slider": of.id,
      oninput: () => of.write(of.scale.value(Number(range.value))),
      onchange: () => this.sliders.settle(),
    });
    const number = h("input", {
      type: "text", inputmode: "decimal", class: "number", "aria-label": `${of.label} in ${unit || "1"}`,
      onchange: () => {
        const value = Number(number.value.replace(",", ".").replace("−", "-"));
        if (number.value.trim() !== "" && Number.isFinite(value)) {
          of.write(toSi(value, of.unit));
          this.sliders.settle();
        } else {
          renew();
        }
      },
    });
    const pull = of.moved ? h("span", { class: "pull" }) : null;
    const renew = () => {
      if (of.is_on && !of.is_on()) return;
      const si = of.read();
      range.value = String(of.scale.place(si));
      const text = `${digits(toUser(si, of.unit))} ${unit}`.trim();
      range.setAttribute("aria-valuetext", text);
      if (document.activeElement !== number) number.value = digits(toUser(si, of.unit)).replace("−", "-");
      if (pull && of.moved) {
        const tolerances = of.moved();
        pull.textContent = Math.abs(tolerances) < 0.005 ? "" : `${tolerances > 0 ? "+" : "−"}${Math.abs(tolerances).toFixed(1)} tol.`;
        pull.classList.toggle("far", Math.abs(tolerances) > 2);
      }
    };
    this.rows.push({ renew });
    return h("div", { class: "slider" },
      h("span", { class: "name", title: of.meaning }, of.name), pull, h("span", { class: "amount" }, number, h("span", { class: "unit" }, unit)), range);
  }
}
