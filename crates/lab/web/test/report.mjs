// Opens a report from disk as a person would who was sent it: no server, no network. Called with the path of a page about a
// fleet of 201 valves, one of them at its end (FV-101), and a campaign whose valve has dry friction that its file lacks.

import { pathToFileURL } from "node:url";
import { check, faint, moving, nameless, open, unreached, until } from "./browser.mjs";

const url = pathToFileURL(process.argv[2]).href;
const { browser, context, page, complaints } = await open(url);
await context.setOffline(true);
await page.reload();
await page.waitForSelector("html[data-ready]");
const text = (selector) => page.locator(selector).first().textContent();

// The first screen: how it stands, what is worst, what is missing, what to do.
const short = await text(".in-short");
for (const words of ["201 valves", "Worst: FV-101", "replace now: FV-101", "missing: dry-friction", "times the noise", "valve adopt"]) {
  check(short.includes(words), `no ${words} in: ${short}`);
}
const box = await page.locator(".in-short").boundingBox();
check(box.y + box.height < 1000, `it is on the first screen, ends at ${box.y + box.height}`);

// The fleet: the one that ends stands first; sort, search, states; its own page by keyboard, and back.
const rows = page.locator(".fleet-body .fleet-row");
await until("the worst stands first", async () => (await rows.first().textContent()).includes("FV-101"));
check((await rows.count()) < 60, "only rows that are seen are in the page");
await page.locator(".fleet-heads").getByRole("button", { name: /^valve/ }).click();
await page.locator(".fleet-heads").getByRole("button", { name: /^valve/ }).click();
await until("the last name first", async () => (await rows.first().textContent()).includes("V-199"));
await page.locator(".fleet-heads").getByRole("button", { name: /^state/ }).click();
await page.getByLabel(/search/).fill("v-12");
await until("the search narrows", async () => (await rows.count()) === 10);
await page.getByLabel(/search/).fill("");
await page.locator('[data-valve="FV-101"]').focus();
await page.keyboard.press("Enter");
await until("the valve's page", async () => (await page.locator(".valve-page .uplot").count()) === 3);
check((await text(".facts")).includes("replace by"), "it says by when to replace");
await page.getByRole("button", { name: /all valves/ }).click();
await until("the keyboard is back at its row", async () => page.locator('[data-valve="FV-101"]').evaluate((one) => one === document.activeElement));

// The strokes: hover, zoom, other runs, other models.
const error = async () => Number(await page.locator("[data-error]").getAttribute("data-error"));
await page.locator(".strokes").scrollIntoViewIfNeeded();
await until("a chart and its residual", async () => (await page.locator(".strokes .uplot").count()) === 2);
const chart = page.locator(".strokes .u-over").first();
await chart.hover({ position: { x: 200, y: 60 } });
await until("the values under the cursor", async () => /\d/.test(await text(".strokes .u-legend .u-value")));
const picture = () => page.locator(".strokes canvas").first().evaluate((canvas) => canvas.toDataURL());
const whole = await picture();
const place = await chart.boundingBox();
await page.mouse.move(place.x + 100, place.y + 60);
await page.mouse.down();
await page.mouse.move(place.x + 300, place.y + 60);
await page.mouse.up();
await until("the zoomed picture", async () => (await picture()) !== whole);
await chart.dblclick();
await until("the whole again", async () => (await picture()) === whole);
const [best, models] = [await error(), await page.locator('[data-choose="model"] option').count()];
check(models === 3, `valve file, calibrated, with friction, found ${models}`);
await page.locator('[data-choose="model"]').selectOption("0");
check((await error()) > 5 * best, `the valve file's error is larger: ${await error()} for ${best}`);
await page.locator('[data-choose="model"]').selectOption("2");
await page.locator('[data-choose="show"]').selectOption("all");
await until("a card a run", async () => (await page.locator(".card .uplot").count()) === 6);
check((await page.locator('[data-candidate="dry-friction"]').count()) === 1, "candidates are drawn");

// A table is put in order by its head.
const table = page.locator(".table:visible").filter({ has: page.locator(".sort") }).first();
const cells = () => table.locator("tbody").evaluate((body) => [...body.rows].map((row) => row.cells[0].textContent));
const before = await cells();
await table.locator(".sort").first().click();
await table.locator(".sort").first().click();
check((await cells()).join() === before.toSorted((a, b) => b.localeCompare(a, undefined, { numeric: true })).join(), `descending by name: ${await cells()}`);

for (const colorScheme of ["light", "dark"]) {
  await page.emulateMedia({ colorScheme });
  const weak = await faint(page);
  check(weak.length === 0, `contrast below 4.5 (${colorScheme}):\n${weak.join("\n")}`);
}
check((await nameless(page)).length === 0, `without a name:\n${(await nameless(page)).join("\n")}`);
const [far, moves] = [await unreached(page), await moving(page)];
check(far.length === 0, `the tab key does not reach:\n${far.join("\n")}`);
check(moves.length === 0, `moves although asked not to: ${moves.join()}`);
for (const width of [400, 3840]) {
  await page.setViewportSize({ width, height: 900 });
  const wide = await page.evaluate(() => document.documentElement.scrollWidth);
  check(wide <= width, `${width} px are enough, found ${wide}`);
}

// On paper: the still figures, none of them larger than a sheet.
await page.emulateMedia({ media: "print", colorScheme: "light" });
await page.setViewportSize({ width: 690, height: 1000 });
check((await page.locator(".live-view:visible").count()) === 0, "what moves is not printed");
const tall = await page.evaluate(() => [...document.querySelectorAll("figure")].map((figure) => figure.getBoundingClientRect().height));
check(tall.length > 10 && tall.every((height) => height > 50 && height < 1010), `figures of ${tall.map(Math.round)} px`);
check(complaints.length === 0, `the console complains:\n${complaints.join("\n")}`);

// Without scripts the same is there, still.
const plain = await browser.newContext({ javaScriptEnabled: false });
const still = await plain.newPage();
await still.goto(url);
check((await still.locator(".still svg:visible").count()) > 5, "figures are seen without scripts");
check((await still.locator(".still table:visible tbody tr").count()) > 201, "all valves are listed without scripts");
await browser.close();
