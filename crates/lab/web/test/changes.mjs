// What goes on under an open `valve lab`: two tabs, a reload, files that change, break and vanish, a program that is killed
// and started again, all with a campaign of 50 runs. Called with the program and a folder with valve.toml and campaign.toml.

import { spawn } from "node:child_process";
import { once } from "node:events";
import { readFileSync, renameSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { check, median, open, until, watch } from "./browser.mjs";

const [program, folder] = process.argv.slice(2);
const TOKEN = "the-same-for-both-starts";
const [valve, campaign] = ["valve.toml", "campaign.toml"].map((name) => join(folder, name));

/** Starts the program; the second time where it was before, so that an open page finds it. */
async function start(port) {
  const child = spawn(program, ["lab", valve, campaign, "--no-open", "--port", String(port), "--token", TOKEN], { stdio: ["ignore", "pipe", "inherit"] });
  const [text] = await once(child.stdout, "data");
  return [child, /http:\S+/.exec(String(text))[0]];
}

let [server, url] = await start(0);
process.on("exit", () => server.kill());
const since = Date.now();
const { browser, context, page, complaints } = await open(url);
const text = (selector, on = page) => on.locator(selector).first().textContent();
const error = (on = page) => on.locator("[data-error]").getAttribute("data-error");
const notice = (on = page) => on.locator(".notice[role=status]:not(.odd-run):visible").first().textContent({ timeout: 1000 }).catch(() => "");
const options = () => page.locator('[data-choose="run"] option').count();
await until("the first error", async () => (await error()) !== "");
console.log(`50 runs: the first picture after ${Date.now() - since} ms`);

// All 50 runs while a slider moves.
await page.locator('[data-choose="show"]').focus();
await page.locator('[data-choose="show"]').selectOption("all");
await until("a card a run", async () => (await page.locator(".card").count()) === 50);
check(await page.locator('[data-choose="show"]').evaluate((one) => one === document.activeElement), "the keyboard stays on the choice that it made");
await page.locator("#on-dry-friction").press("Space");
const force = page.locator('[data-slider="dry-friction.coulomb_force"]');
const drawn = async () => Number(await page.locator("[data-pictures]").getAttribute("data-pictures"));
const latencies = [];
for (let place = 300; place < 700; place += 20) {
  const last = await drawn();
  await force.evaluate((element, value) => {
    element.value = String(value);
    element.dispatchEvent(new Event("input", { bubbles: true }));
  }, place);
  await until("a slider's picture", async () => (await drawn()) > last, 10);
  latencies.push(Number(await page.locator("[data-latency]").getAttribute("data-latency")));
}
await force.dispatchEvent("change");
console.log(`50 runs: a slider's change was on the screen within ${median(latencies).toFixed(0)} ms (median of ${latencies.length})`);

// Two tabs: each has its sliders, both see the search that either starts or stops.
const second = await context.newPage();
watch(second, url, complaints);
await second.goto(url);
await until("the second tab", async () => (await error(second)) !== "");
check((await error()) !== (await error(second)), "each tab has its own sliders");
for (const tab of [page, second]) await tab.getByRole("tab", { name: "Explain" }).click();
await second.locator("#explain-go").click();
await until("both tabs know that it runs", async () => (await text(".explain-status")).startsWith("searching") && (await text(".explain-status", second)).startsWith("searching"), 10);
await page.getByRole("button", { name: "fit this" }).click();
await until("one thing at a time", async () => (await text(".fit")).includes("wait for what runs"), 10);
await page.locator("#explain-go").click();
await until("stopped in both", async () => !(await text(".explain-status", second)).startsWith("searching"), 120);

// A reload: the sliders, the tab and what is shown stay.
const kept = await error();
await page.reload();
await until("the same sliders", async () => (await error()) === kept);
await until("the same view", async () => (await page.locator(".card").count()) === 50);
check((await text('[role=tab][aria-selected="true"]')) === "Explain", "the same tab");

// A file that changes, one that breaks, one that vanishes; each is said, and what was read before goes on.
const before = readFileSync(valve, "utf8");
const as_file = await error(second);
writeFileSync(valve, before.replace('stiffness = "16 kN/m"', 'stiffness = "17 kN/m"'));
await until("the change", async () => (await error(second)) !== as_file, 20);
writeFileSync(valve, "name = 3");
await until("what is wrong with the file", async () => (await notice(second)).includes("valve.toml:1"), 20);
const last = await error();
await page.locator("#on-dry-friction").press("Space");
await until("the page goes on with what was read", async () => (await error()) !== last, 10);
await second.reload();
await until("a reload says it too", async () => (await notice(second)).includes("valve.toml:1"), 20);
writeFileSync(valve, before);
await until("the file is mended", async () => (await error(second)) === as_file, 20);
const trace = join(folder, "run-3.csv");
renameSync(trace, `${trace}.away`);
await until("a trace is gone", async () => (await notice(second)).includes("run-3.csv"), 20);
renameSync(`${trace}.away`, trace);
await until("and back", async () => !(await notice(second)).includes("run-3.csv"), 20);

// Fewer runs, while one that goes is shown.
await page.locator('[data-choose="show"]').selectOption("one");
await page.locator('[data-choose="run"]').selectOption("49");
const runs = readFileSync(campaign, "utf8");
writeFileSync(campaign, runs.split("\n[[run]]").slice(0, 6).join("\n[[run]]"));
await until("five runs", async () => (await options()) === 5, 20);
await until("a chart of one of them", async () => (await page.locator(".strokes .uplot").count()) === 2);
writeFileSync(campaign, runs);
await until("fifty again", async () => (await options()) === 50, 20);

// Killed and started again, its files changed meanwhile: the page says that it is alone, and then takes up by itself.
server.kill("SIGKILL");
await until("it says so", async () => page.locator("[role=alert]:visible").first().isVisible(), 20);
check((await text("[role=alert]:visible")).includes("has ended"), await text("[role=alert]:visible"));
await page.locator("#on-dry-friction").press("Space");
writeFileSync(valve, before.replace('stiffness = "16 kN/m"', 'stiffness = "18 kN/m"'));
[server] = await start(new URL(url).port);
await until("it takes up", async () => (await page.locator("[role=alert]:visible").count()) === 0, 30);
await until("with the files as they are now", async () => (await error(second)) !== as_file, 20);
await second.locator("#explain-go").click();
await until("a search of the new program", async () => (await text(".explain-status", second)).startsWith("searching"), 10);
await second.locator("#explain-go").click();
await until("its answer, or that there is none", async () => /found|stopped/.test(await text(".explain-status", second)), 120);

// What a browser itself says of refused requests and of a program that is gone is no complaint of the page.
const own = complaints.filter((words) => !/409|ERR_CONNECTION_REFUSED|ERR_INCOMPLETE_CHUNKED|ERR_CONNECTION_RESET|ERR_EMPTY_RESPONSE/.test(words));
check(own.length === 0, `the console complains:\n${own.join("\n")}`);
await browser.close();
server.kill();
