/** What the sliders say, with undo; kept over a reload of the tab. */

import type { Description, EffectInfo, EffectValues, Model } from "./api";

export interface EffectState {
  on: boolean;
  values: (number | null)[];
}

interface Snapshot {
  parameters: Record<string, number>;
  effects: Record<string, EffectState>;
}

/** Steps that can be undone. */
const STEPS = 200;

export class Sliders {
  private now: Snapshot = { parameters: {}, effects: {} };
  private past: string[] = [];
  private future: string[] = [];
  private settled = "";
  private listeners: (() => void)[] = [];
  private lab!: Description;

  /** Begins with a valve file: with what this tab had before a reload, or as the file has it. */
  begin(lab: Description): void {
    const before = this.lab ? JSON.stringify(this.now) : sessionStorage.getItem(key(lab));
    const was_as_in_file = this.lab ? this.is_as_in_file() : false;
    this.lab = lab;
    this.now = this.of_model(lab.model);
    if (before !== null && !was_as_in_file) this.take(JSON.parse(before) as Snapshot);
    this.settled = JSON.stringify(this.now);
    this.changed();
  }

  listen(listener: () => void): void {
    this.listeners.push(listener);
  }

  parameter(key_: string): number {
    return this.now.parameters[key_] ?? this.lab.parameters.find((one) => one.key === key_)!.value;
  }

  effect(id: string): EffectState {
    return this.now.effects[id]!;
  }

  set_parameter(key_: string, si: number): void {
    this.now.parameters[key_] = si;
    this.changed();
  }

  /** Moves a value; those that follow it, or may not be below it, go along. */
  set_value(info: EffectInfo, index: number, si: number): void {
    const { values } = this.effect(info.id);
    const before = values[index];
    values[index] = si;
    info.parameters.forEach((parameter, other) => {
      const value = values[other];
      if (other === index || value === null || value === undefined) return;
      const follows = parameter.follows === index && value === before;
      const below = parameter.at_least === index && value < si;
      if (follows || below) values[other] = si;
    });
    const floor = info.parameters[index]!.at_least;
    if (floor !== null && floor !== undefined) values[index] = Math.max(si, values[floor] ?? 0);
    this.changed();
  }

  set_on(info: EffectInfo, on: boolean): void {
    const state = this.effect(info.id);
    state.on = on;
    this.changed();
    this.settle();
  }

  /** The hand is off: one step for undo. */
  settle(): void {
    const text = JSON.stringify(this.now);
    if (text === this.settled) return;
    this.past.push(this.settled);
    this.past.splice(0, this.past.length - STEPS);
    this.future = [];
    this.settled = text;
    this.changed();
  }

  get can_undo(): boolean {
    return this.past.length > 0;
  }

  get can_redo(): boolean {
    return this.future.length > 0;
  }

  undo(): void {
    const before = this.past.pop();
    if (before === undefined) return;
    this.future.push(this.settled);
    this.show(before);
  }

  redo(): void {
    const after = this.future.pop();
    if (after === undefined) return;
    this.past.push(this.settled);
    this.show(after);
  }

  /** Puts a model on the sliders. */
  put(model: Model): void {
    this.now = this.of_model(model);
    this.settle();
  }

  /** Puts effects on the sliders by the names of their parameters; those that are on before go off. */
  put_effects(effects: string[], values: { effect: string; name: string; value: number | null }[]): void {
    for (const info of this.infos()) {
      const state = this.effect(info.id);
      state.on = effects.includes(info.id);
      if (!state.on) continue;
      state.values = first_values(info);
      for (const { effect, name, value } of values) {
        const index = info.parameters.findIndex((parameter) => parameter.name === name);
        if (effect === info.id && index >= 0) state.values[index] = value;
      }
    }
    this.settle();
  }

  as_in_file(): void {
    this.put(this.lab.model);
  }

  is_as_in_file(): boolean {
    return JSON.stringify(this.now) === JSON.stringify(this.of_model(this.lab.model));
  }

  model(): Model {
    const on = (infos: EffectInfo[]): EffectValues[] =>
      infos.filter((info) => this.effect(info.id).on).map((info) => ({ name: info.id, values: this.effect(info.id).values }));
    const moved = this.lab.parameters.filter((one) => this.parameter(one.key) !== one.value);
    return {
      parameters: Object.fromEntries(moved.map((one) => [one.key, this.parameter(one.key)])),
      effects: on(this.lab.effects),
      custom: on(this.lab.custom),
    };
  }

  infos(): EffectInfo[] {
    return [...this.lab.effects, ...this.lab.custom];
  }

  private show(text: string): void {
    this.settled = text;
    this.now = JSON.parse(text) as Snapshot;
    this.changed();
  }

  private changed(): void {
    sessionStorage.setItem(key(this.lab), JSON.stringify(this.now));
    this.listeners.forEach((listener) => listener());
  }

  private of_model(model: Model): Snapshot {
    const effects: Record<string, EffectState> = {};
    for (const info of this.infos()) {
      const given = [...model.effects, ...model.custom].find((one) => one.name === info.id);
      effects[info.id] = given ? { on: true, values: [...given.values] } : { on: false, values: first_values(info) };
    }
    return { parameters: { ...model.parameters }, effects };
  }

  /** A snapshot of before, as far as the file still has what it names. */
  private take(before: Snapshot): void {
    for (const { key: name } of this.lab.parameters) {
      const value = before.parameters[name];
      if (value !== undefined) this.now.parameters[name] = value;
    }
    for (const info of this.infos()) {
      const state = before.effects[info.id];
      if (state && state.values.length === info.parameters.length) this.now.effects[info.id] = state;
    }
  }
}

const key = (lab: Description): string => `${lab.valve.file} beside ${lab.campaign.file}`;

function first_values(info: EffectInfo): (number | null)[] {
  const values = info.parameters.map((parameter) => parameter.first);
  info.parameters.forEach((parameter, index) => {
    if (parameter.follows !== null) values[index] = values[parameter.follows] ?? null;
  });
  return values;
}
