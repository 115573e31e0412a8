// Headless Chromium for the tests, with an eye on every word of complaint and every request that leaves this machine.

import { existsSync } from "node:fs";
import { chromium } from "playwright-core";

const FLAGS = ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
  "--disable-component-update", "--disable-sync"];

export async function open(url, options = {}) {
  const places = [process.env.CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"];
  const executablePath = places.find((place) => place && existsSync(place));
  if (!executablePath) throw new Error("no Chromium: expected /usr/bin/chromium, or its path in CHROMIUM");
  const browser = await chromium.launch({ executablePath, args: FLAGS });
  const context = await browser.newContext({ viewport: { width: 1500, height: 1000 }, ...options });
  const page = await context.newPage();
  const complaints = [];
  watch(page, url, complaints);
  if (url) await page.goto(url);
  return { browser, context, page, complaints };
}

/** Notes errors of a page and requests to anywhere else. */
export function watch(page, url, complaints) {
  page.on("console", (message) => {
    if (["error", "warning"].includes(message.type())) complaints.push(message.text());
  });
  page.on("pageerror", (error) => complaints.push(String(error.stack)));
  page.on("request", (request) => {
    const asked = request.url();
    const is_here = asked === url || asked.startsWith("data:") || asked.startsWith("blob:") || (url && asked.startsWith(new URL(url).origin));
    if (!is_here) complaints.push(`asks elsewhere: ${asked}`);
  });
}

export function check(is_so, words) {
  if (!is_so) throw new Error(words);
}

/** Waits until something holds. */
export async function until(words, holds, seconds = 60) {
  const end = Date.now() + 1000 * seconds;
  while (!(await holds())) {
    if (Date.now() > end) throw new Error(`not within ${seconds} s: ${words}`);
    await new Promise((resolve) => setTimeout(resolve, 40));
  }
}

export const median = (values) => values.toSorted((a, b) => a - b)[Math.floor(values.length / 2)];

/** Every text on the page whose contrast with what is behind it is below 4.5 (3 where it is large). */
export async function faint(page) {
  return page.evaluate(() => {
    const numbers = (text) => (text.match(/[\d.]+/g) ?? []).map(Number);
    const light = ([r, g, b]) => {
      const part = (value) => (value / 255 <= 0.03928 ? value / 255 / 12.92 : ((value / 255 + 0.055) / 1.055) ** 2.4);
      return 0.2126 * part(r) + 0.7152 * part(g) + 0.0722 * part(b);
    };
    const behind = (element) => {
      for (let at = element; at; at = at.parentElement) {
        const paper = numbers(getComputedStyle(at).backgroundColor);
        if (paper.length === 3 || paper[3] > 0.5) return paper;
      }
      return [255, 255, 255];
    };
    const found = [];
    for (const element of document.querySelectorAll("body *")) {
      const own = [...element.childNodes].some((node) => node.nodeType === 3 && node.textContent.trim() !== "");
      if (!own || !element.checkVisibility({ visibilityProperty: true }) || element.matches(":disabled, .unseen")) continue;
      const style = getComputedStyle(element);
      const [a, b] = [light(numbers(style.color)), light(behind(element))];
      const contrast = (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
      const large = parseFloat(style.fontSize) >= 24 || (parseFloat(style.fontSize) >= 18.66 && Number(style.fontWeight) >= 700);
      if (contrast < (large ? 3 : 4.5)) found.push(`${contrast.toFixed(2)}: ${element.textContent.trim().slice(0, 40)}`);
    }
    return found;
  });
}

/** Controls that a screen reader cannot name. */
export async function nameless(page) {
  return page.evaluate(() => [...document.querySelectorAll("button, input, select, [role=img], [role=tab]")]
    .filter((element) => element.checkVisibility())
    .filter((element) => !(element.getAttribute("aria-label") || element.textContent.trim() || element.labels?.length))
    .map((element) => element.outerHTML.slice(0, 120)));
}

/** Presses of the tab key that may go elsewhere: scrolled boxes, the browser's own. */
const SPARE = 40;

/** Controls that the tab key does not reach; of tabs and of a group of them the chosen one is enough. */
export async function unreached(page) {
  const wanted = await page.evaluate(() => {
    const is_control = "button, input, select, summary, a[href], [role=tab]";
    const all = [...document.querySelectorAll(is_control)].filter((one) => one.checkVisibility({ visibilityProperty: true }) && !one.disabled && one.getAttribute("aria-selected") !== "false"
      // In a grid the tab key leads to one row, and the arrow keys to the others.
      && !(one.tabIndex < 0 && one.closest("[role=grid]")));
    all.forEach((one, index) => { one.dataset.reach = String(index); });
    scrollTo(0, 0);
    document.activeElement?.blur();
    return all.length;
  });
  for (let press = 0; press < wanted + SPARE; press += 1) {
    await page.keyboard.press("Tab");
    const rest = await page.evaluate(() => {
      document.activeElement?.removeAttribute("data-reach");
      return document.querySelectorAll("[data-reach]").length;
    });
    if (rest === 0) return [];
  }
  return page.evaluate(() => [...document.querySelectorAll("[data-reach]")].filter((one) => one.isConnected && one.checkVisibility()).map((one) => one.outerHTML.slice(0, 120)));
}

/** What moves although the person has asked for no motion. */
export async function moving(page) {
  await page.emulateMedia({ reducedMotion: "reduce" });
  return page.evaluate(() => [...document.querySelectorAll("*")].filter((one) => {
    const { transitionDuration, animationName, scrollBehavior } = getComputedStyle(one);
    return transitionDuration.split(",").some((time) => parseFloat(time) > 0) || animationName !== "none" || scrollBehavior === "smooth";
  }).map((one) => one.className));
}
