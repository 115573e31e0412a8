/** The lab: everything put together. */

import { api, follow, Refused, type Description, type LabEvent, type Model, type SimulatedRun } from "./api";
import { Adopt } from "./adopt";
import { fill, h, say } from "./dom";
import { digits } from "./numbers";
import { Explain } from "./explain";
import { Experiment } from "./experiment";
import { Fit } from "./fit";
import { Missing } from "./missing";
import { Physics } from "./physics";
import { Scores } from "./scores";
import { Sliders } from "./sliders";
import { Strokes } from "./strokes";
import { Tabs } from "./tabs";

const sliders = new Sliders();
const physics = new Physics(sliders);
const scores = new Scores();
const strokes = new Strokes(() => void lay_out(), "strokes");
const fit = new Fit(sliders, physics.fit);
const explain = new Explain(sliders);
const missing = new Missing(() => api.missing(sliders.model()));
const adopt = new Adopt(sliders);
const experiment = new Experiment(sliders, explain);

explain.show_run = (name) => strokes.show_run(name);
explain.listen(() => {
  strokes.mark(explain.left_out(lab.version));
  next_step.hidden ||= !explain.is_idle;
});

const line = h("p", { class: "notice bad", role: "alert", hidden: true });
const told = h("p", { class: "notice", role: "status", hidden: true });
const speed = h("span", { class: "speed", "data-latency": "", "data-pictures": "0" });
const names = h("div", { class: "names" });
/** What to do first, until a search has been started. */
const next_step = h("p", { class: "next-step", hidden: true });
const next_words = h("span", {});

/** Errors up to this many times the noise need no search. */
const SOUND = 1.2;

function show_next_step(normalised_rms: number): void {
  next_step.hidden = !explain.is_idle;
  const is_sound = normalised_rms < SOUND;
  say(next_words, is_sound ? "The valve file's model agrees with the record to within its noise: nothing is missing so far."
    : `The valve file's model (thin line) is off the record (broad line) by ${digits(normalised_rms, 3)} times the noise. Let the program search, or switch effects on and drag their sizes until the lines meet.`);
  next_step.querySelector("button")!.hidden = is_sound;
}

let lab: Description;
/** Whether all that the program said of the files has been taken in. */
let is_begun = false;
/** Which start of the program the page was told by. */
let started_ms: number | null = null;
/** The samples that are laid out; a model that was asked for others is not drawn. */
let layout = 0;
/** Whether the valve file's model, which all others are held against, is known for the samples that are laid out. */
let is_laid_out = false;
let busy = false;
let waiting: { since: number } | null = null;
let since: number | null = null;
/** A slider moves: only what is on the screen is drawn, and what is close by once it rests. */
let hand_moves = false;
let rests = 0;
/** A slider that has not moved for this long rests, ms. */
const REST_MS = 200;
/** Models drawn so far. */
let pictures = 0;

/** Simulates the sliders' model; while one is under way, only the newest of those that follow is kept. */
async function simulate(): Promise<void> {
  if (!is_laid_out) return;
  const asked = { since: since ?? performance.now() };
  since = null;
  if (busy) {
    waiting = { since: waiting?.since ?? asked.since };
    return;
  }
  busy = true;
  const wanted = layout;
  // The program works on the next model while this one is drawn.
  const answer = await api.simulate(sliders.model(), strokes.near(hand_moves))
    .catch((error: unknown) => refused(error, (message) => physics.refuse(message)))
    .finally(next);
  if (!answer || wanted !== layout || answer.version !== lab.version) return;
  strokes.show(answer.runs);
  scores.show(answer.comparison);
  physics.refuse(null);
  const drawn = await next_picture();
  say(speed, `${lab.runs.length} runs simulated and drawn in ${Math.round(drawn - asked.since)} ms`);
  speed.dataset["latency"] = (drawn - asked.since).toFixed(1);
  speed.dataset["pictures"] = String(++pictures);
}

/** Asks for the model that has been waited with. */
function next(): void {
  busy = false;
  if (waiting) {
    since = waiting.since;
    waiting = null;
    void simulate();
  }
}

/** The instant at which what was drawn is on the screen, or about to be. */
const next_picture = (): Promise<number> =>
  new Promise((resolve) => {
    if (document.hidden) resolve(performance.now());
    else requestAnimationFrame(() => resolve(performance.now()));
  });

/** Fetches what was recorded and the valve file's model at the samples that are shown now. */
async function lay_out(): Promise<void> {
  layout += 1;
  const wanted = layout;
  const show = strokes.selection();
  try {
    const [measured, before] = await Promise.all([api.measured(show), before_at(show)]);
    if (wanted !== layout || measured.version !== lab.version) return;
    strokes.lay_out(measured.runs, before);
    is_laid_out = true;
    void simulate();
  } catch (error) {
    refused(error, (message) => physics.refuse(message));
  }
}

async function before_at(show: ReturnType<Strokes["selection"]>): Promise<SimulatedRun[]> {
  const answer = await api.simulate(lab.model as Model, show);
  scores.begin(lab, answer.comparison);
  show_next_step(answer.comparison.overall.normalised_rms);
  return answer.runs;
}

function refused(error: unknown, say_so: (message: string) => void): void {
  if (error instanceof Refused) {
    // That the program is gone is said once, above all.
    if (error.status !== 0) say_so(error.message);
  } else {
    throw error;
  }
}

/** Reads everything from the program, at first and when the files have changed. */
async function begin(): Promise<void> {
  is_begun = false;
  lab = await api.lab();
  document.title = `${lab.valve.name} – valve lab`;
  fill(names, h("h1", {}, lab.valve.name),
    h("p", {}, `${file_name(lab.valve.file)} beside ${lab.campaign.name}`,
      lab.doubts.length > 0 && h("details", { class: "doubts" }, h("summary", {}, `${lab.doubts.length} doubt${lab.doubts.length > 1 ? "s" : ""} about the files`), h("ul", {}, ...lab.doubts.map((doubt) => h("li", {}, doubt))))));
  strokes.begin(lab);
  strokes.element.hidden = !strokes.has_traces;
  experiment.begin(lab);
  sliders.begin(lab);
  missing.begin(strokes.has_traces);
  physics.begin(lab);
  adopt.begin(lab.has_log === true);
  const answers = await api.answers();
  fit.take(answers.fit, lab.version);
  explain.take(answers.explain, lab.version);
  strokes.mark(explain.left_out(lab.version));
  await lay_out();
  is_begun = true;
}

/** The same while the page stands: where the program is gone meanwhile, it is begun again when it is back. */
async function begin_again(): Promise<void> {
  try {
    await begin();
  } catch (error) {
    if (!(error instanceof Refused && error.status === 0)) throw error;
  }
}

const file_name = (path: string): string => path.split(/[/\\]/).pop() ?? path;

function happened(event: LabEvent): void {
  switch (event.event) {
    case "hello":
      told_trouble(event.trouble);
      // The answers of a program that has ended say nothing of those of the next one.
      if (started_ms !== null && started_ms !== event.started_ms) {
        is_begun = false;
        fit.forget();
        explain.forget();
      }
      started_ms = event.started_ms;
      fit.running(event.job.running?.kind === "fit" ? event.job.running.seconds : null);
      explain.running(event.job.running?.kind === "explain" ? event.job.running.seconds : null);
      next_step.hidden ||= !explain.is_idle;
      // The program was started anew, or the files changed while the line was broken.
      if (!is_begun || event.version !== lab.version) void begin_again();
      else void answers();
      break;
    case "changed":
      told.hidden = false;
      say(told, "The files have changed on disk and were read again.");
      setTimeout(() => { told.hidden = true; }, 6000);
      void begin_again();
      break;
    case "trouble":
      told_trouble(event.message);
      break;
    case "started":
      if (event.kind === "fit") fit.running(0);
      else explain.running(0);
      next_step.hidden ||= !explain.is_idle;
      break;
    case "finished":
      if (event.kind === "fit") fit.running(null);
      else explain.running(null);
      void answers(event.kind);
      break;
    case "lagged":
      void answers();
      break;
    default:
      explain.progress(event);
  }
}

async function answers(finished?: string): Promise<void> {
  const last = await api.answers();
  fit.take(last.fit, lab.version, finished === "fit");
  explain.take(last.explain, lab.version);
}

function told_trouble(message: string | null): void {
  told.hidden = message === null;
  if (message !== null) say(told, `The files on disk cannot be used as they are now; shown is what was read before. ${message}`);
}

const tabs = new Tabs([
  ["scores", "Error", scores.element],
  ["explain", "Explain", explain.element],
  ["missing", "Missing force", missing.element],
  ["adopt", "Adopt", adopt.element],
  ["experiment", "Experiment", experiment.element],
], (name) => {
  missing.seen(name === "missing");
  adopt.seen(name === "adopt");
  experiment.seen(name === "experiment");
});

next_step.append(next_words, h("button", { type: "button", class: "strong", onclick: () => {
  tabs.open("explain");
  explain.go();
} }, "look for what is missing"));

const page = document.getElementById("page")!;
fill(page,
  h("header", { class: "head" }, names, scores.head, speed),
  line, told, next_step,
  h("main", {}, h("div", { class: "left" }, strokes.element, tabs.element), h("aside", { "aria-label": "model" }, physics.element, fit.element)));

sliders.listen(() => {
  if (!lab) return;
  since ??= performance.now();
  hand_moves = true;
  clearTimeout(rests);
  rests = setTimeout(() => {
    hand_moves = false;
    void simulate();
  }, REST_MS) as unknown as number;
  void simulate();
  missing.changed();
  adopt.changed();
  experiment.changed();
});
let scrolled = 0;
addEventListener("scroll", () => {
  // Charts that were far away are drawn once they come near.
  clearTimeout(scrolled);
  scrolled = setTimeout(() => void simulate(), 120) as unknown as number;
}, { passive: true });

void begin().then(() => {
  page.dataset["ready"] = "";
  follow<LabEvent>(happened, (is_there) => {
    line.hidden = is_there;
    if (!is_there) say(line, "The program that drew this page has ended or does not answer. Start it again (valve lab …) and open the address that it prints; this page takes up by itself if it only paused.");
  });
}).catch((error: unknown) => {
  fill(page, h("p", { class: "notice bad", role: "alert" }, `The page cannot begin: ${error instanceof Error ? error.message : String(error)}`));
});
