/** A report: the views of the lab and the watch, frozen. What they show stands in the page itself; without this script, and on
 *  paper, its tables and figures say the same. */

import type { Comparison, Description, FleetRow, Found, MeasuredRun, Missing as MissingForce, SimulatedRun, ValvePast } from "./api";
import { fill, h } from "./dom";
import { FleetView } from "./fleet_view";
import { found_view } from "./found";
import { Missing } from "./missing";
import { fixed } from "./numbers";
import { Scores } from "./scores";
import { sortable } from "./sortable";
import { Strokes } from "./strokes";
import { ValvePage } from "./valve";

interface FrozenFleet {
  limits_s: [number, number];
  /** A column each. */
  rows: Record<Exclude<keyof FleetRow, "small">, unknown[]>;
  /** In the order of the rows: the newest estimate, the past, the remarks. */
  valves: [ValvePast["now"], ValvePast["past"], ValvePast["remarks"]][];
}

interface FrozenCampaign {
  lab: Description;
  models: string[];
  comparisons: Comparison[];
  channels: Record<string, { measured: MeasuredRun[]; simulated: SimulatedRun[][] }>;
  missing: MissingForce[];
  answer: Found | null;
}

function fleet(frozen: FrozenFleet): HTMLElement {
  const columns = Object.entries(frozen.rows);
  const all = frozen.valves.map(([now, past, remarks], index): ValvePast => {
    const row = Object.fromEntries(columns.map(([key, values]) => [key, values[index]])) as unknown as FleetRow;
    row.small = [past[0] as number[], past[1]!];
    return { now, row, past, remarks };
  });
  const [only] = all;
  if (only && all.length === 1) {
    const page = new ValvePage(() => Promise.resolve(only), null);
    page.element.hidden = false;
    page.begin(frozen.limits_s);
    return started(page.element, () => void page.show(only.row.valve));
  }
  const valves = new Map(all.map((one) => [one.row.valve, one]));
  const view = new FleetView((valve) => {
    const found = valves.get(valve);
    return found ? Promise.resolve(found) : Promise.reject(new Error(`the log has no valve ${valve}`));
  });
  view.one.begin(frozen.limits_s);
  view.show(new Map(all.map(({ row }) => [row.valve, row])));
  return started(view.element, () => view.route());
}

function strokes(frozen: FrozenCampaign): HTMLElement {
  const { lab, models, comparisons, channels } = frozen;
  // The best that is known: the last of the models.
  let model = models.length - 1;
  const view = new Strokes(() => lay_out());
  const scores = new Scores();
  const missing = new Missing(() => Promise.resolve(frozen.missing[model]!));
  const lay_out = () => {
    const { runs, channel } = view.selection();
    const of = channels[channel]!;
    const wanted = <T extends { run: number }>(all: T[]) => all.filter((one) => runs.includes(one.run));
    view.lay_out(wanted(of.measured), wanted(of.simulated[0]!));
    view.show(wanted(of.simulated[model]!));
  };
  const show = () => {
    scores.show(comparisons[model]!);
    lay_out();
    missing.changed();
  };
  const choice = models.length > 1 && h("label", {}, "model ", h("select", { "data-choose": "model", onchange: (event: Event) => { model = Number((event.target as HTMLSelectElement).value); show(); } },
    ...models.map((name, index) => h("option", { value: index, selected: index === model }, name))));
  const left = frozen.answer?.document.steps.at(-1)?.rmse_m;
  const allowing = left === undefined || left === null ? "" : ` With what they were found to be off by, ${fixed(1e3 * left, 3)} mm is left by the last step of the search below.`;
  view.begin(lab);
  view.mark(frozen.answer?.document.left_out ?? null);
  scores.begin(lab, comparisons[0]!);
  missing.begin(view.has_traces);
  view.element.hidden = !view.has_traces;
  addEventListener("scroll", () => lay_out(), { passive: true });
  return started(h("div", {}, h("div", { class: "bar" }, choice, scores.head),
    h("p", { class: "aside" }, `Every sample counts here, and instruments and supply gauges are taken at their word, as valve compare does.${allowing}`), view.element, scores.element, missing.element), () => {
    show();
    missing.seen(true);
  });
}

const answer = (frozen: FrozenCampaign): HTMLElement => (frozen.answer ? found_view(frozen.answer, null) : h("div", {}));

/** Charts need a width: what draws them begins once it is in the page. */
function started(element: HTMLElement, begin: () => void): HTMLElement {
  requestAnimationFrame(begin);
  return element;
}

const VIEWS: Record<string, (data: never) => HTMLElement> = { fleet, strokes, answer };

const held = new Map<string, unknown>();

/** What the page holds under a name. */
function data(name: string): unknown {
  if (!held.has(name)) held.set(name, JSON.parse(document.getElementById(`data-${name}`)!.textContent!));
  return held.get(name);
}

for (const place of document.querySelectorAll<HTMLElement>("[data-view]")) {
  const live = h("div", { class: "live-view" });
  fill(live, VIEWS[place.dataset["view"]!]!(data(place.dataset["of"]!) as never));
  place.prepend(live);
  place.classList.add("is-live");
}
document.querySelectorAll("table").forEach((one) => sortable(one));
document.documentElement.dataset["ready"] = "";
