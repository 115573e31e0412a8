/** What the server is asked and what it answers. Paths are relative: the token stands in the page's address. */

export interface Unit {
  name: string;
  factor: number;
  shift: number;
}

export interface EffectValues {
  name: string;
  values: (number | null)[];
}

export interface Model {
  parameters: Record<string, number>;
  effects: EffectValues[];
  custom: EffectValues[];
}

export interface RunInfo {
  name: string;
  is_trace: boolean;
  end_s: number | null;
  condition: number;
  supply_kpa: number;
  supply_kpa_gauge: number;
  temperature_k: number;
  leak_to_atmosphere_mm2: number;
  leak_from_supply_mm2: number;
}

export interface Tolerated {
  key: string;
  unit: Unit;
  value: number;
  tolerance: number;
  lower: number;
  upper: number;
}

export interface EffectParameter {
  name: string;
  meaning: string;
  unit: Unit;
  lower: number;
  typical: number;
  upper: number;
  first: number | null;
  follows: number | null;
  at_least: number | null;
  refinement: boolean;
}

export interface EffectInfo {
  id: string;
  summary: string;
  equation: string;
  symptom?: string;
  typical_sizes?: string;
  confused_with?: string[];
  source?: string;
  acts_on?: string;
  parameters: EffectParameter[];
}

export interface Description {
  version: number;
  valve: { name: string; file: string };
  campaign: { name: string; file: string };
  stroke_mm: number;
  doubts: string[];
  runs: RunInfo[];
  channels: string[];
  parameters: Tolerated[];
  effects: EffectInfo[];
  custom: EffectInfo[];
  model: Model;
  /** Whether a timing log was given. */
  has_log?: boolean;
}

export interface Selection {
  runs: number[];
  window_s: [number, number] | null;
  points: number;
  channel: string;
}

export interface MeasuredRun {
  run: number;
  time_s: number[];
  measured: (number | null)[] | null;
}

export interface StrokeInfo {
  direction: "closing" | "opening";
  command_s: number;
  until_s: number;
  ends_s: [number, number, number];
  measured_s: number | null;
  simulated_s: number | null;
}

export interface SimulatedRun {
  run: number;
  simulated: (number | null)[];
  strokes: StrokeInfo[];
}

export interface PhaseScore {
  rmse_m: number | null;
  share: number | null;
  time_error_s: number | null;
}

export interface Score {
  rmse_m: number | null;
  normalised_rms: number;
  close_time_error_s: number | null;
  open_time_error_s: number | null;
  phases: Partial<Record<"closing" | "opening", Record<string, PhaseScore>>>;
}

export interface Comparison {
  overall: Score & { noise_m: number | null; noise_source: string };
  runs: (Score & { file: string })[];
  words: string[];
}

export interface Simulated {
  version: number;
  comparison: Comparison;
  runs: SimulatedRun[];
}

export interface Bin {
  at: number;
  force_n: number;
  standard_error_n: number;
}

export interface Missing {
  version: number;
  force: {
    pressure: string;
    against: Record<string, Record<"closing" | "opening", Bin[]>>;
  } | null;
}

export interface Step {
  step: string;
  normalised_rms: number;
  held_out_normalised_rms: number | null;
  rmse_m: number | null;
  held_out_rmse_m: number | null;
  time_rmse_s: number | null;
}

export interface FittedParameter {
  effect: string;
  name: string;
  value: number;
  standard_error: number;
  unit: string;
}

export interface Candidate {
  effects: string[];
  parameters: FittedParameter[];
  log_evidence_gain: number;
  probability: number | null;
  normalised_rms: number;
  held_out_normalised_rms: number | null;
  rmse_m: number | null;
  rejected: string | null;
}

export interface PlannedRun {
  commands: { at_s: number; close: boolean }[];
  end_s: number;
  supply_pressure_pa: number;
  temperature_k: number;
  leak_to_atmosphere_m2: number;
  leak_from_supply_m2: number;
}

export interface Twins {
  effect: string;
  with: { effect: string; behind: number; model: Model; spread: Model[]; parameters: FittedParameter[] }[];
  experiment: {
    purpose: string;
    separation: number;
    decides: boolean;
    pressures: boolean;
    repeats: number;
    toml: string;
    time_s: number[];
    position_mm: number[][];
    plan: PlannedRun;
  } | null;
}

/** A job that has begun. */
export interface Started {
  job: number;
  kind: string;
}

export interface Answered {
  version: number;
  job: number;
  seconds: number;
  error?: string;
}

/** What a search has found. */
export interface Found {
  headline: string;
  document: FoundDocument;
  model: Model;
  /** Models that differ from it by a standard deviation each, in independent ways: what the data leave open. */
  spread: Model[];
  twins: Twins[];
  noise_mm: number | null;
}

export interface FitAnswer extends Answered {
  how: string;
  headline: string;
  model: Model;
  steps?: Step[];
  parameters?: FittedParameter[];
  calibration?: {
    reasons: string[];
    parameters: { parameter: string; standard_error: number; pull: number }[];
  };
}

/** A run that contradicts all others under a condition that was written down for it; SI. */
export interface LeftOut {
  run: string;
  condition: "supply_pressure" | "temperature" | "leak_to_atmosphere" | "leak_from_supply";
  stated: number;
  right: number;
  stated_rmse_m: number;
  right_rmse_m: number;
  others_rmse_m: number;
}

export interface FoundDocument {
  verdict: string;
  recommended: string[];
  parameters: FittedParameter[];
  candidates: Candidate[];
  steps: Step[];
  notes: string[];
  interrupted: boolean;
  probability: { effects: Record<string, number>; models: { effects: string[]; probability: number }[] };
  left_out: LeftOut | null;
  residual: { toml: string; acts_on: string; along: string; custom: { formula: string } } | null;
  nuisances: { what: string; run: string | null; value: number; standard_error: number; unit: string; at_bound: boolean }[];
}

export type ExplainAnswer = Answered & Found;

/** What each model predicts of a planned run, and half the width of its band where it has one. */
export interface Prediction {
  time_s: number[];
  position_mm: number[][];
  band_mm: (number[] | null)[];
}

/** The end of life by a timing log, after some of its cycles, with each model. */
export interface Lives {
  log: string;
  valve: string;
  after_cycles: number[];
  models: { model: string; told: { eol_cycle: number | null; eol_bounds: [number, number] | null }[] | null; no_tables?: string }[];
}

export interface Preview {
  version: number;
  changes: boolean;
  diff: [string, string][];
  path: string;
}

/** The server said no, or is gone. */
export class Refused extends Error {
  constructor(
    message: string,
    readonly status: number,
  ) {
    super(message);
  }
}

async function asked<T>(path: string, body?: unknown): Promise<T> {
  let response: Response;
  try {
    response = await fetch(path, body === undefined
      ? {}
      : { method: "POST", headers: { "content-type": "application/json" }, body: JSON.stringify(body) });
  } catch {
    throw new Refused("the program does not answer", 0);
  }
  if (!response.ok) {
    const text = await response.text();
    let message = text;
    try {
      message = (JSON.parse(text) as { error: string }).error;
    } catch {
      // A refusal that is plain text is the message itself.
    }
    throw new Refused(message, response.status);
  }
  return (await response.json()) as T;
}

export const api = {
  lab: () => asked<Description>("api/lab"),
  measured: (selection: Selection) => asked<{ version: number; runs: MeasuredRun[] }>("api/measured", selection),
  simulate: (model: Model, show: Selection) => asked<Simulated>("api/simulate", { model, show }),
  missing: (model: Model) => asked<Missing>("api/missing", model),
  predict: (models: Model[], spread: Model[][], plan: PlannedRun) =>
    asked<Prediction>("api/predict", { models, spread, ...plan }),
  answers: () => asked<{ fit?: FitAnswer; explain?: ExplainAnswer }>("api/job"),
  fit: (model: Model) => asked<Started>("api/job", { job: "fit", model }),
  explain: () => asked<Started>("api/job", { job: "explain" }),
  stop: () => asked<{ asked: boolean }>("api/stop", {}),
  lives: (model: Model) => asked<Lives>("api/lives", model),
  preview: (model: Model) => asked<Preview>("api/preview", model),
  write: (model: Model, path: string, replace: boolean) =>
    asked<{ written: string } | { exists: string }>("api/write", { model, path, replace }),
};

export type LabEvent =
  | { event: "hello"; started_ms: number; version: number; trouble: string | null; job: { number: number; running: { kind: string; seconds: number } | null } }
  | { event: "changed"; version: number }
  | { event: "trouble"; message: string }
  | { event: "lagged" }
  | { event: "started"; job: number; kind: string }
  | { event: "finished"; job: number; kind: string }
  | { event: "tried"; effects: string[]; log_evidence: number; error: number; of: number }
  | { event: "reached"; effects: string[]; gain: number }
  | { event: "doing"; what: string };

/** Follows the server's events; the browser takes up a broken line by itself, and `line` is told of both. */
export function follow<T>(each: (event: T) => void, line: (is_there: boolean) => void): void {
  const source = new EventSource("api/events");
  source.onmessage = (message) => {
    line(true);
    each(JSON.parse(message.data as string) as T);
  };
  source.onerror = () => line(false);
}

export interface FleetRow {
  valve: string;
  status: string;
  fault: string;
  cycle: number;
  rows: number;
  time: string | null;
  severity: number | null;
  leak_mm2: number | null;
  leak_limit_mm2: number | null;
  rul: [number | null, number | null, number | null];
  replace_by_cycle: number | null;
  replace_by: string | null;
  caveat: string | null;
  /** Cycles, and the wear at each. */
  small: [number[], (number | null)[]];
}

export interface Fleet {
  tables: { id: string; limit: number }[];
  limits_s: [number, number];
  logs: string[];
  rows: FleetRow[];
  troubles: string[];
}

export interface ValvePast {
  now: { fault_probability: Record<string, number> | null; eol_cycle: number | null; eol_time?: string | null };
  row: FleetRow;
  /** Cycle; wear; cycles left, 5, 50 and 95 %; closing and opening time, s. */
  past: (number | null)[][];
  remarks: [number, string][];
}

export const watch_api = {
  fleet: () => asked<Fleet>("api/fleet"),
  valve: (valve: string) => asked<ValvePast>("api/valve", { valve }),
};

export type WatchEvent =
  | { event: "hello" }
  | { event: "lagged" }
  | { event: "rows"; rows: FleetRow[]; troubles: string[] };
