/** The watch: all valves worst first, and one valve's past; both follow the logs. */

import { follow, watch_api, type Fleet, type FleetRow, type WatchEvent } from "./api";
import { fill, h, say } from "./dom";
import { FleetView } from "./fleet_view";

const line = h("p", { class: "notice bad", role: "alert", hidden: true });
const troubles = h("details", { class: "doubts", hidden: true });
const told = h("span", { class: "speed" });
const view = new FleetView((valve) => watch_api.valve(valve), troubles);
const { one } = view;

const rows = new Map<string, FleetRow>();
let fleet: Fleet;
let all_troubles: string[] = [];

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
  one.begin(fleet.limits_s);
  view.show(rows);
  show_troubles();
}

function happened(event: WatchEvent): void {
  if (event.event !== "rows") {
    void begin();
    return;
  }
  for (const row of event.rows) rows.set(row.valve, row);
  all_troubles.push(...event.troubles);
  view.show(rows);
  if (event.troubles.length > 0) show_troubles();
  say(told, `${event.rows.length} valve${event.rows.length > 1 ? "s" : ""} changed at ${new Date().toLocaleTimeString()}`);
  if (one.valve !== null && event.rows.some((row) => row.valve === one.valve)) void one.renew();
}

const page = document.getElementById("page")!;
fill(page, h("header", { class: "head" }, h("div", { class: "names" }, h("h1", {}, "Valves"), h("p", { class: "logs" })), told),
  line, h("div", { class: "watch" }, view.element));

void begin().then(() => {
  say(page.querySelector(".logs")!, fleet.logs.join(", "));
  page.dataset["ready"] = "";
  view.route();
  follow<WatchEvent>(happened, (is_there) => {
    line.hidden = is_there;
    if (!is_there) say(line, "The program that drew this page has ended or does not answer: nothing here is new any more. Start it again (valve watch …) and open the address that it prints.");
  });
}).catch((error: unknown) => {
  fill(page, h("p", { class: "notice bad", role: "alert" }, `The page cannot begin: ${error instanceof Error ? error.message : String(error)}`));
});
