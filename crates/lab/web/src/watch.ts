/** The watch: all valves worst first, and one valve's past; both follow the logs. */

import { follow, watch_api, type Fleet, type FleetRow, type WatchEvent } from "./api";
import { fill, h, say } from "./dom";
import { FleetTable, STATES } from "./fleet";
import { ValvePage } from "./valve";

const line = h("p", { class: "notice bad", role: "alert", hidden: true });
const troubles = h("details", { class: "doubts", hidden: true });
const counts = h("div", { class: "counts", role: "group", "aria-label": "valves by state; press to show only these" });
const summary = h("p", { class: "summary", role: "status" });
const told = h("span", { class: "speed" });
const table = new FleetTable((valve) => open(valve));
const one = new ValvePage(() => open(null));

const rows = new Map<string, FleetRow>();
let fleet: Fleet;
let all_troubles: string[] = [];

function show_counts(): void {
  const of = (state: string) => [...rows.values()].filter((row) => row.status === state).length;
  fill(counts, ...STATES.map(([state, sign, words]) => {
    const count = of(state);
    const pressed = table.states.has(state);
    return h("button", { type: "button", class: `count state-${state}`, "aria-pressed": String(pressed), disabled: count === 0 && !pressed, title: words,
      onclick: () => { table.toggle(state); show_counts(); } },
      h("strong", {}, count), h("span", {}, `${sign} ${state.replaceAll("-", " ")}`));
  }));
  const worst = table.worst();
  const urgent = of("eol-reached") + of("act-now");
  say(summary, rows.size === 0 ? "No row has come yet."
    : urgent === 0 ? `${rows.size} valves, none at its end. ${worst && worst.replace_by_cycle !== null ? `Next: ${worst.valve}, replace by cycle ${worst.replace_by_cycle}.` : ""}`
    : `${urgent} of ${rows.size} valves must be replaced now. Worst: ${worst!.valve}.`);
}

function show_troubles(): void {
  troubles.hidden = all_troubles.length === 0;
  fill(troubles, h("summary", {}, `${all_troubles.length} row${all_troubles.length > 1 ? "s" : ""} or logs could not be read`),
    h("ul", {}, ...all_troubles.slice(-20).map((text) => h("li", {}, text))));
}

async function begin(): Promise<void> {
  fleet = await watch_api.fleet();
  rows.clear();
  for (const row of fleet.rows) rows.set(row.valve, row);
  all_troubles = fleet.troubles;
  one.begin(fleet);
  table.show(rows);
  show_counts();
  show_troubles();
}

/** Shortest time between two looks at the whole fleet, ms, where very many valves change at once. */
const PAUSE = 3000;
let looking = false;

/** Looks at the whole fleet, and not again before a pause. */
function look(): void {
  if (looking) return;
  looking = true;
  void begin().finally(() => setTimeout(() => { looking = false; }, PAUSE));
}

function happened(event: WatchEvent): void {
  if (event.event === "many") {
    say(told, `${event.count} valves changed at ${new Date().toLocaleTimeString()}`);
    if (one.valve === null) look();
    else void one.renew();
    return;
  }
  if (event.event !== "rows") {
    void begin();
    return;
  }
  for (const row of event.rows) rows.set(row.valve, row);
  all_troubles.push(...event.troubles);
  table.show(rows);
  show_counts();
  if (event.troubles.length > 0) show_troubles();
  say(told, `${event.rows.length} valve${event.rows.length > 1 ? "s" : ""} changed at ${new Date().toLocaleTimeString()}`);
  if (one.valve !== null && event.rows.some((row) => row.valve === one.valve)) void one.renew();
}

function open(valve: string | null): void {
  const hash = valve === null ? "" : `#${encodeURIComponent(valve)}`;
  if (location.hash !== hash) location.hash = hash;
  else route();
}

/** The page's address says which valve is looked at, so that a reload and the back button lead there. */
function route(): void {
  const valve = decodeURIComponent(location.hash.slice(1));
  one.element.hidden = valve === "";
  list.hidden = valve !== "";
  void one.show(valve === "" ? null : valve);
  if (valve === "") table.show(rows);
  else scrollTo(0, 0);
}

const page = document.getElementById("page")!;
const list = h("div", { class: "fleet" }, counts, summary, troubles, table.element);
fill(page, h("header", { class: "head" }, h("div", { class: "names" }, h("h1", {}, "Valves"), h("p", { class: "logs" })), told),
  line, h("div", { class: "watch" }, list, one.element));
addEventListener("hashchange", route);

void begin().then(() => {
  say(page.querySelector(".logs")!, fleet.logs.join(", "));
  page.dataset["ready"] = "";
  route();
  follow<WatchEvent>(happened, (is_there) => {
    line.hidden = is_there;
    if (!is_there) say(line, "The program that drew this page has ended or does not answer: nothing here is new any more. Start it again (valve watch …) and open the address that it prints.");
  });
}).catch((error: unknown) => {
  fill(page, h("p", { class: "notice bad", role: "alert" }, `The page cannot begin: ${error instanceof Error ? error.message : String(error)}`));
});
