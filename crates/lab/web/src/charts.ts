/** Charts by uPlot: chosen since it redraws thousands of points in a millisecond, in 50 kB. */

import type UPlot from "uplot";
import type { StrokeInfo } from "./api";
import { digits } from "./numbers";

declare const uPlot: typeof UPlot;

export type Column = (number | null | undefined)[];

/** Colours that were asked for: to look one up anew costs as much as a chart, where much of the page has just changed. */
const colours = new Map<string, string>();

/** A colour of the style sheet, as it is at the moment (light, dark, printed). */
export function colour(name: string): string {
  const known = colours.get(name);
  if (known !== undefined) return known;
  const found = getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
  colours.set(name, found);
  return found;
}

export interface Line {
  label: string;
  /** Name of a colour of the style sheet. */
  colour: string;
  width: number;
  dash?: number[];
  /** Only points, no line. */
  points?: boolean;
  /** Not in the legend: the edge of a band. */
  unnamed?: boolean;
}

export interface ChartOptions {
  title: string;
  height: number;
  x: string;
  y: string;
  lines: Line[];
  /** Charts of the same group share their cursor. */
  group?: string;
  phases?: () => StrokeInfo[];
  /** The range of y that is shown at least. */
  y_at_least?: [number, number];
  /** Symmetric about zero. */
  symmetric?: boolean;
  logarithmic?: boolean;
  legend?: boolean;
  small?: boolean;
  name_phases?: boolean;
  zoomed?: (window: [number, number] | null) => void;
  /** Filled between two lines, by their place among the lines. */
  bands?: [number, number][];
  /** Names of colours for them, where they differ. */
  band_colours?: string[];
  /** Bars about the points of a line, such as errors. */
  bars?: () => { colour: string; x: number; low: number; high: number }[];
  /** Levels drawn across. */
  levels?: () => { value: number; label: string }[];
}

const FONT = "12px system-ui, sans-serif";

const PHASES = ["dead time", "breakaway", "travel", "seating"];

/** All charts that are on the page, to be drawn anew when colours or sizes change. */
const charts = new Set<Chart>();

export class Chart {
  readonly element: HTMLElement;
  private plot: UPlot | null = null;
  private data: UPlot.AlignedData;
  private window: [number, number] | null = null;
  private readonly observer: ResizeObserver;

  constructor(private readonly options: ChartOptions) {
    this.element = document.createElement("div");
    this.element.className = "chart";
    this.element.setAttribute("role", "img");
    this.element.setAttribute("aria-label", options.title);
    this.element.style.minHeight = `${options.height}px`;
    this.data = [[], ...options.lines.map(() => [])] as unknown as UPlot.AlignedData;
    this.observer = new ResizeObserver(() => this.fit());
    this.observer.observe(this.element);
    charts.add(this);
  }

  /** Shows other numbers; drawn at once. */
  show(x: Column, ...lines: Column[]): void {
    this.data = [x, ...lines] as unknown as UPlot.AlignedData;
    if (!this.plot) this.draw();
    this.plot?.setData(this.data, false);
    this.rescale();
  }

  /** What the whole chart says in words, for those who do not see it. */
  tell(words: string): void {
    this.element.setAttribute("aria-label", `${this.options.title}: ${words}`);
  }

  /** Shows a part of the x axis, or all. */
  zoom(window: [number, number] | null): void {
    this.window = window;
    this.rescale();
  }

  redraw(): void {
    this.plot?.destroy();
    this.plot = null;
    if (this.element.isConnected && (this.data[0] as Column).length > 0) {
      this.draw();
      this.rescale();
    }
  }

  remove(): void {
    this.observer.disconnect();
    this.plot?.destroy();
    charts.delete(this);
    this.element.remove();
  }

  private rescale(): void {
    const plot = this.plot;
    const x = this.data[0] as Column;
    if (!plot || x.length === 0) return;
    const [min, max] = this.window ?? [x[0] as number, x[x.length - 1] as number];
    // One point alone has no width.
    plot.setScale("x", max > min ? { min, max } : { min: min - 0.5, max: max + 0.5 });
  }

  private fit(): void {
    const width = this.element.clientWidth;
    if (this.plot && width > 0 && Math.abs(width - this.plot.width) > 1) {
      this.plot.setSize({ width, height: this.options.height });
    }
  }

  private draw(): void {
    const width = this.element.clientWidth || 600;
    const { options } = this;
    const ink = colour("ink-soft");
    const axis = {
      stroke: ink,
      font: FONT,
      labelFont: FONT,
      labelSize: 18,
      grid: { stroke: colour("grid"), width: 1 },
      ticks: { stroke: colour("grid"), width: 1, size: 4 },
    };
    const { y_at_least, symmetric } = options;
    const range = (_: UPlot, low: number | null, high: number | null): [number, number] => {
      let [min, max] = [low ?? 0, high ?? 1];
      if (y_at_least) [min, max] = [Math.min(min, y_at_least[0]), Math.max(max, y_at_least[1])];
      if (symmetric) {
        const size = Math.max(Math.abs(min), Math.abs(max)) || 1;
        return [-1.05 * size, 1.05 * size];
      }
      const margin = 0.04 * (max - min) || 1;
      return [min - margin, max + margin];
    };
    const plot = new uPlot(
      {
        width,
        height: options.height,
        padding: [options.small ? 4 : 8, 10, 0, 0],
        legend: { show: options.legend ?? !options.small, live: true },
        cursor: {
          y: false,
          drag: { x: options.zoomed !== undefined, y: false, setScale: false },
          ...(options.group ? { sync: { key: options.group, setSeries: false } } : {}),
          points: { size: 6 },
        },
        scales: {
          x: { time: false },
          y: options.logarithmic ? { distr: 3 } : { range },
        },
        axes: [
          { ...axis, ...(options.x === "" ? { labelSize: 0 } : { label: options.x }), size: 34, values: (_, ticks) => ticks.map((tick) => digits(tick, 6).replace(/\.?0+$/, "")) },
          { ...axis, label: options.y, size: options.small ? 40 : 52, values: (_, ticks) => ticks.map((tick) => (tick === null ? "" : short(tick))) },
        ],
        ...(options.bands ? { bands: options.bands.map(([upper, lower], index) => ({
          series: [upper + 1, lower + 1] as UPlot.Band.Bounds,
          fill: options.band_colours ? `color-mix(in srgb, ${colour(options.band_colours[index]!)} 22%, transparent)` : colour("band"),
        })) } : {}),
        series: [
          { label: options.x || "x", value: (_, value) => digits(value, 5) },
          ...options.lines.map((line) => ({
            label: line.label,
            ...(line.unnamed ? { class: "unnamed" } : {}),
            stroke: colour(line.colour),
            width: line.points ? 0 : line.width,
            ...(line.dash ? { dash: line.dash } : {}),
            points: line.points
              ? { show: true, size: 6, fill: colour(line.colour), stroke: colour(line.colour) }
              : { show: false },
            ...(line.points ? { paths: () => null } : {}),
            value: (_: UPlot, value: number | null) => digits(value, 4),
          })),
        ],
        hooks: {
          drawClear: [(drawn) => this.shade(drawn)],
          draw: [(drawn) => this.beside(drawn)],
          setSelect: [
            (drawn) => {
              const { left, width: wide } = drawn.select;
              if (wide > 4) options.zoomed?.([drawn.posToVal(left, "x"), drawn.posToVal(left + wide, "x")]);
              drawn.setSelect({ left: 0, top: 0, width: 0, height: 0 }, false);
            },
          ],
          ready: [(drawn) => this.listen(drawn)],
        },
      },
      this.data,
      this.element,
    );
    this.plot = plot;
  }

  /** Bars of errors, and levels. */
  private beside(plot: UPlot): void {
    const { ctx, bbox } = plot;
    const ratio = devicePixelRatio;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    for (const bar of this.options.bars?.() ?? []) {
      const x = plot.valToPos(bar.x, "x", true);
      const [low, high] = [plot.valToPos(bar.low, "y", true), plot.valToPos(bar.high, "y", true)];
      ctx.fillStyle = colour(bar.colour);
      ctx.fillRect(x - 0.5 * ratio, high, ratio, low - high);
      for (const end of [low, high]) ctx.fillRect(x - 2.5 * ratio, end - 0.5 * ratio, 5 * ratio, ratio);
    }
    for (const level of this.options.levels?.() ?? []) {
      const y = plot.valToPos(level.value, "y", true);
      ctx.fillStyle = colour("bad");
      ctx.fillRect(bbox.left, y - 0.5 * ratio, bbox.width, 1.5 * ratio);
      ctx.font = `${11 * ratio}px system-ui, sans-serif`;
      ctx.textAlign = "left";
      ctx.textBaseline = "bottom";
      ctx.fillText(level.label, bbox.left + 4 * ratio, y - 2 * ratio);
    }
    ctx.restore();
  }

  /** The phases of each stroke behind the data. */
  private shade(plot: UPlot): void {
    const { phases } = this.options;
    if (!phases) return;
    const { ctx, bbox } = plot;
    const ratio = devicePixelRatio;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    ctx.font = `${11 * ratio}px system-ui, sans-serif`;
    ctx.textAlign = "left";
    ctx.textBaseline = "top";
    const fills = [colour("phase-a"), colour("phase-b")];
    for (const stroke of phases()) {
      const bounds = [stroke.command_s, ...stroke.ends_s, stroke.until_s];
      PHASES.forEach((name, index) => {
        const from = plot.valToPos(bounds[index]!, "x", true);
        const to = plot.valToPos(bounds[index + 1]!, "x", true);
        // What comes after the seating is rest: it fades out.
        ctx.fillStyle = index === 3 ? "transparent" : fills[index % 2]!;
        ctx.fillRect(from, bbox.top, to - from, bbox.height);
        const wide = ctx.measureText(name).width;
        const left = Math.max(from, bbox.left) + 4 * ratio;
        if (this.options.name_phases && to - left > wide + 2 * ratio) {
          ctx.fillStyle = colour("ink-soft");
          ctx.fillText(name, left, bbox.top + 3 * ratio);
        }
      });
      const at = Math.round(plot.valToPos(stroke.command_s, "x", true));
      ctx.fillStyle = colour("ink-soft");
      ctx.fillRect(at, bbox.top, ratio, bbox.height);
    }
    ctx.restore();
  }

  private listen(plot: UPlot): void {
    const { zoomed } = this.options;
    if (!zoomed) return;
    plot.over.addEventListener("dblclick", () => zoomed(null));
    plot.over.addEventListener(
      "wheel",
      (event) => {
        if (!event.ctrlKey && !event.metaKey) return;
        event.preventDefault();
        const { min, max } = plot.scales["x"]!;
        const at = plot.posToVal(event.offsetX, "x");
        const factor = event.deltaY < 0 ? 0.8 : 1.25;
        zoomed([at - (at - min!) * factor, at + (max! - at) * factor]);
      },
      { passive: false },
    );
    // With the shift key held the part that is shown moves with the hand.
    plot.over.addEventListener(
      "mousedown",
      (event) => {
        if (!event.shiftKey || event.button !== 0) return;
        event.stopImmediatePropagation();
        const { min, max } = plot.scales["x"]!;
        const start = event.clientX;
        const each = (max! - min!) / plot.over.clientWidth;
        const move = (now: MouseEvent) => {
          const shift = (start - now.clientX) * each;
          zoomed([min! + shift, max! + shift]);
        };
        const up = () => {
          removeEventListener("mousemove", move);
          removeEventListener("mouseup", up);
        };
        addEventListener("mousemove", move);
        addEventListener("mouseup", up);
      },
      { capture: true },
    );
  }
}

/** A tick's number, as short as it can be. */
function short(value: number): string {
  return digits(value, 4).replace(/(\.\d*?)0+$/, "$1").replace(/\.$/, "");
}

function redraw_all(): void {
  colours.clear();
  charts.forEach((chart) => chart.redraw());
}
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", redraw_all);
addEventListener("beforeprint", redraw_all);
addEventListener("afterprint", redraw_all);
