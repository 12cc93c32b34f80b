/** The map's colours, from the same custom properties as the rest of the page. */
const NAMES = {
  water: '--map-water', grid: '--map-grid', axis: '--map-axis', ink: '--map-ink', soft: '--ink-3', halo: '--map-halo', leader: '--leader',
  follower: '--follower', safe: '--safe', unsafe: '--unsafe', warn: '--warn', idle: '--idle', accent: '--accent', surface: '--surface',
} as const;

export type Palette = Record<keyof typeof NAMES, string>;

export function readPalette(element: Element): Palette {
  const style = getComputedStyle(element);
  const entries = Object.entries(NAMES).map(([name, property]) => [name, style.getPropertyValue(property).trim() || '#888']);
  return Object.fromEntries(entries) as Palette;
}
