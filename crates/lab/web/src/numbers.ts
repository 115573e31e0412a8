/** Numbers as people read them. */

import type { Unit } from "./api";

/** So many significant digits, plain where that is short. */
export function digits(value: number | null | undefined, count = 4): string {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size < 1e-3 || size >= 1e6) return minus(value.toExponential(count - 1).replace("e+", "e"));
  const before = Math.floor(Math.log10(size)) + 1;
  return minus(value.toFixed(Math.max(0, count - before)));
}

/** So many decimals. */
export function fixed(value: number | null | undefined, decimals: number): string {
  return value === null || value === undefined || !Number.isFinite(value) ? "–" : minus(value.toFixed(decimals));
}

/** Cycles, whole; what is far beyond any plan is told as that. */
export function cycles(value: number | null | undefined): string {
  return value !== null && value !== undefined && value >= 1e4 ? "> 9999" : fixed(value, 0);
}

/** So many decimals, with a sign. */
export function signed(value: number | null | undefined, decimals: number): string {
  const text = fixed(value, decimals);
  return value !== null && value !== undefined && value > 0 ? `+${text}` : text;
}

const minus = (text: string): string => text.replace("-", "−");

/** An SI value in the user's unit. */
export const toUser = (si: number, unit: Unit): number => si * unit.factor + unit.shift;

/** A value in the user's unit as SI. */
export const toSi = (value: number, unit: Unit): number => (value - unit.shift) / unit.factor;

const PRETTY: [RegExp, string][] = [[/m2\b/g, "m²"], [/m3\b/g, "m³"], [/ s\/m/g, "·s/m"], [/deg([CF])/g, "°$1"]];

/** A unit as it is printed. */
export const pretty = (unit: string): string => PRETTY.reduce((text, [from, to]) => text.replace(from, to), unit);

/** A share in percent. */
export const percent = (share: number): string =>
  share > 0 && share < 0.005 ? "< 1 %" : share > 0.995 && share < 1 ? "> 99 %" : `${Math.round(100 * share)} %`;
