// Looks at `valve watch` while a log grows: 200 healthy valves, and one that comes to its end. Called with the page's
// address and a folder with the log (grows.csv) and the rows that are to come (rest.csv).

import { appendFileSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { check, faint, moving, nameless, open, unreached, until } from "./browser.mjs";

const [url, folder] = process.argv.slice(2);
const { browser, page, complaints } = await open(url);
const first = () => page.locator(".fleet-body .fleet-row").first().textContent();
const count = (state) => page.locator(`.count.state-${state} strong`).textContent();

await until("200 valves stand", async () => (await count("healthy")) === "200");
check((await page.locator(".fleet-body .fleet-row").count()) < 60, "only the rows that are seen are in the page");

// Rows come while the page is open; nothing is loaded anew.
await page.evaluate(() => { window.not_loaded_anew = true; });
const rows = readFileSync(join(folder, "rest.csv"), "utf8").trim().split("\n");
const valve = rows[0].split(",")[0];
for (let from = 0; from < rows.length; from += 8) {
  appendFileSync(join(folder, "grows.csv"), `${rows.slice(from, from + 8).join("\n")}\n`);
  await new Promise((resolve) => setTimeout(resolve, 150));
}
const cycle = rows[rows.length - 1].split(",")[1];
await until("the one that wears is the worst", async () => (await first()).includes(valve) && (await first()).includes(cycle));
check(await page.evaluate(() => window.not_loaded_anew), "the page was not loaded anew");
console.log(`worst: ${await first()}`);

// Search, states, order; then the valve's own page, by keyboard.
await page.getByLabel(/search/).fill("V-12");
await until("the search narrows", async () => (await page.locator(".fleet-body .fleet-row").count()) === 10);
await page.getByLabel(/search/).fill("");
await page.locator(".count.state-healthy").click();
await until("only healthy ones", async () => !(await first()).includes(valve));
await page.locator(".count.state-healthy").click();
await page.getByRole("columnheader", { name: /valve/ }).getByRole("button").click();
await until("by name", async () => (await first()).includes(valve) || (await first()).includes("V-000"));
await page.getByRole("columnheader", { name: /state/ }).getByRole("button").click();
await until("worst first again", async () => (await first()).includes(valve));

// Two hundred valves are one stop of the tab key; the arrow keys lead from one to the next, however far away.
const stops = () => page.locator(".fleet-body button").evaluateAll((all) => all.filter((one) => one.tabIndex === 0).length);
const focused = () => page.evaluate(() => document.activeElement.dataset.valve ?? "");
const screen = async () => page.evaluate(() => document.activeElement.getBoundingClientRect()).then((box) => box.top >= 0 && box.bottom <= 1000);
check((await stops()) === 1, `one stop of the tab key, found ${await stops()}`);
await page.getByRole("columnheader", { name: /replace by/ }).getByRole("button").focus();
await page.keyboard.press("Tab");
check((await focused()) === valve, `the tab key leads to the first row, found ${await focused()}`);
await page.keyboard.press("ArrowDown");
const second = await focused();
check(second !== valve && second !== "", `an arrow key leads on, found ${second}`);
await page.keyboard.press("End");
const end = await focused();
check(end !== second && (await screen()), `the last row is reached and seen, found ${end}`);
await page.keyboard.press("ArrowUp");
check((await focused()) !== end && (await screen()), "and the one before it");
check((await stops()) === 1, `still one stop, found ${await stops()}`);
await page.keyboard.press("Tab");
check((await focused()) === "", "the tab key leads out of the rows");
await page.keyboard.press("Shift+Tab");
check((await focused()) !== "" && (await focused()) !== end, "and back to where it was");
await page.keyboard.press("Home");
check((await focused()) === valve && (await screen()), "the first row again");
await page.keyboard.press("Enter");
await until("the valve's page", async () => (await page.locator(".valve-page .uplot").count()) === 3);
check((await page.locator(".facts").textContent()).includes("replace by"), "it says by when to replace");

// It follows too.
const next = Number(cycle) + 1;
const [, , close, opens] = rows[rows.length - 1].split(",");
appendFileSync(join(folder, "grows.csv"), `${valve},${next},${close},${opens}\n`);
await until("the valve's page follows", async () => (await page.locator(".facts").textContent()).includes(`cycle ${next}`));
await page.reload();
await until("a reload stays with the valve", async () => (await page.locator(".valve-page .uplot").count()) === 3);

for (const colorScheme of ["light", "dark"]) {
  await page.emulateMedia({ colorScheme });
  const weak = await faint(page);
  check(weak.length === 0, `contrast below 4.5 (${colorScheme}, a valve):\n${weak.join("\n")}`);
}
await page.getByRole("button", { name: /all valves/ }).click();
await until("all valves again", async () => (await page.locator(".fleet-body .fleet-row").count()) > 10);
for (const colorScheme of ["light", "dark"]) {
  await page.emulateMedia({ colorScheme });
  const weak = await faint(page);
  check(weak.length === 0, `contrast below 4.5 (${colorScheme}, all):\n${weak.join("\n")}`);
}
check((await nameless(page)).length === 0, `without a name:\n${(await nameless(page)).join("\n")}`);
const [far, moves] = [await unreached(page), await moving(page)];
check(far.length === 0, `the tab key does not reach:\n${far.join("\n")}`);
check(moves.length === 0, `moves although asked not to: ${moves.join()}`);
check(complaints.length === 0, `the console complains:\n${complaints.join("\n")}`);
await browser.close();
