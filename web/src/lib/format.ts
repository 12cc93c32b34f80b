/**
 * Numbers for people. SI in, text out; an unknown value is always a dash and never a zero, so that nobody reads
 * "0 %" where nothing was measured.
 */

/** What stands for "not known". */
export const UNKNOWN = '–';

/** Narrow no-break space: keeps a number and its unit on one line. */
const NBSP = '\u202f';

const known = (value: number | null | undefined): value is number => value !== null && value !== undefined && Number.isFinite(value);

/** `value` with `digits` decimals and a unit; a true minus sign, and no "−0.0". */
export function quantity(value: number | null | undefined, digits: number, unit: string): string {
  if (!known(value)) return UNKNOWN;
  return `${fixed(value, digits)}${NBSP}${unit}`;
}

/** Fixed decimals with a typographic minus; what rounds to zero has no sign. */
export function fixed(value: number, digits: number): string {
  const text = Math.abs(value).toFixed(digits);
  return value < 0 && Number(text) !== 0 ? `\u2212${text}` : text;
}

/** A length on a human scale: millimetres under 1 m of wave, metres, then kilometres. */
export function length(value_m: number | null | undefined): string {
  if (!known(value_m)) return UNKNOWN;
  const size = Math.abs(value_m);
  if (size >= 1000) return quantity(value_m / 1000, size >= 10_000 ? 0 : 1, 'km');
  return quantity(value_m, size >= 100 ? 0 : 1, 'm');
}

/** A wave height: centimetres with one decimal, which is the scale on which a landing is decided. */
export const waveHeight = (value_m: number | null | undefined): string => (known(value_m) ? quantity(value_m * 100, 1, 'cm') : UNKNOWN);

/** How long ago, coarse enough not to flicker: `now`, `2.3 s`, `12 s`, `4 min`, `3 h`. */
export function age(age_s: number | null | undefined): string {
  if (!known(age_s)) return UNKNOWN;
  const size = Math.max(0, age_s);
  if (size < 1) return 'now';
  if (size < 10) return quantity(size, 1, 's');
  if (size < 120) return quantity(Math.floor(size), 0, 's');
  if (size < 7200) return quantity(Math.floor(size / 60), 0, 'min');
  return quantity(Math.floor(size / 3600), 0, 'h');
}

/** A span that is running out: `1:05` or `23 s`; whole seconds rounded down, so that it never promises more than there is. */
export function countdown(left_s: number): string {
  const whole = Math.max(0, Math.floor(left_s));
  return whole >= 60 ? `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, '0')}${NBSP}min` : `${whole}${NBSP}s`;
}

/** Degrees, whole, always three figures as headings are spoken: `007°`. */
export function heading(heading_deg: number | null | undefined): string {
  if (!known(heading_deg)) return UNKNOWN;
  const whole = ((Math.round(heading_deg) % 360) + 360) % 360;
  return `${String(whole).padStart(3, '0')}°`;
}

/** Per cent without decimals. */
export const percent = (value_percent: number | null | undefined): string => quantity(value_percent, 0, '%');

/** Latitude and longitude to a decimetre or so: `60.12345° N, 24.98765° E`. */
export function latLon(latitude_deg: number, longitude_deg: number): string {
  const ns = latitude_deg < 0 ? 'S' : 'N';
  const ew = longitude_deg < 0 ? 'W' : 'E';
  return `${Math.abs(latitude_deg).toFixed(6)}° ${ns}, ${Math.abs(longitude_deg).toFixed(6)}° ${ew}`;
}

/** Time of day of a fleet stamp (milliseconds since the epoch), in the reader's zone: `14:03:09`. */
export function timeOfDay(stamp_ms: number | null | undefined): string {
  if (!known(stamp_ms)) return UNKNOWN;
  const date = new Date(stamp_ms);
  if (Number.isNaN(date.getTime())) return UNKNOWN;
  const two = (n: number): string => String(n).padStart(2, '0');
  return `${two(date.getHours())}:${two(date.getMinutes())}:${two(date.getSeconds())}`;
}

/** `awaiting_approval` → `Awaiting approval`. For words that the page has no better name for. */
export function words(name: string): string {
  const spaced = name.replaceAll('_', ' ').trim();
  return spaced === '' ? UNKNOWN : spaced.charAt(0).toUpperCase() + spaced.slice(1);
}

/** A kind of GNSS fix as receivers name it. */
export function fixKind(kind: string | null | undefined): string {
  if (kind === null || kind === undefined) return UNKNOWN;
  const names: Record<string, string> = {
    no_gps: 'No GPS', no_fix: 'No fix', '2d': '2-D', '3d': '3-D', dgps: 'DGPS', rtk_float: 'RTK float', rtk_fixed: 'RTK fixed', other: 'Other',
  };
  return names[kind] ?? words(kind);
}
