import { describe, expect, it } from 'vitest';
import css from './tokens.css?raw';

/** Relative luminance and contrast ratio of WCAG 2.2. */
const luminance = (hex: string): number => {
  const [r, g, b] = [1, 3, 5].map((at) => Number.parseInt(hex.slice(at, at + 2), 16) / 255).map((c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4));
  return 0.2126 * r! + 0.7152 * g! + 0.0722 * b!;
};
const contrast = (a: string, b: string): number => {
  const [light, dark] = [luminance(a), luminance(b)].sort((x, y) => y - x);
  return (light! + 0.05) / (dark! + 0.05);
};

const [light, dark] = css.split("[data-theme='dark']").map((part) => Object.fromEntries([...part.matchAll(/--([\w-]+):\s*(#[0-9a-f]{6})/g)].map((m) => [m[1]!, m[2]!])));

// Text on what it stands on, in sunlight and at night.
const PAIRS: [string, string][] = [
  ...['ink', 'ink-2', 'ink-3'].flatMap((text) => ['surface', 'surface-2', 'bg'].map((on): [string, string] => [text, on])),
  ['on-accent', 'accent'], ['accent', 'surface'],
  ['on-safe', 'safe'], ['on-unsafe', 'unsafe'], ['on-warn', 'warn'], ['on-idle', 'idle'],
  ['safe', 'safe-bg'], ['unsafe', 'unsafe-bg'], ['warn', 'warn-bg'], ['ink', 'warn-bg'], ['ink', 'unsafe-bg'], ['ink-2', 'idle-bg'], ['ink-2', 'unsafe-bg'], ['ink-2', 'safe-bg'],
  ['leader', 'map-halo'], ['follower', 'map-halo'], ['safe', 'map-halo'], ['idle', 'map-halo'], ['map-ink', 'map-water'], ['ink-3', 'map-water'],
];

describe.each([['light', light!], ['dark', dark!]])('the %s theme', (_, colours) => {
  it('is the WCAG formula', () => expect(contrast('#000000', '#ffffff')).toBeCloseTo(21, 9));
  it.each(PAIRS)('%s on %s can be read', (text, on) => {
    expect(colours[text], text).toBeDefined();
    expect(colours[on], on).toBeDefined();
    expect(contrast(colours[text]!, colours[on]!)).toBeGreaterThanOrEqual(4.5);
  });
  it.each([['leader', 'map-water'], ['follower', 'map-water'], ['safe', 'map-water'], ['unsafe', 'map-water'], ['chart-line', 'surface'], ['line-strong', 'surface']])(
    '%s stands out from %s',
    (mark, on) => expect(contrast(colours[mark]!, colours[on]!)).toBeGreaterThanOrEqual(3),
  );
});
