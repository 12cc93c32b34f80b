/** What a sea state says beside height and verdict, in words; what is not known is left out. */
import type { SeaState } from '../../api/types';

export interface Fact { name: string; text: string }

const SECTORS = ['N', 'NE', 'E', 'SE', 'S', 'SW', 'W', 'NW'];

/** 0 to 360 degrees as one of eight winds. */
export const compass = (deg: number): string => SECTORS[Math.round((((deg % 360) + 360) % 360) / 45) % 8] ?? '';

export function seaFacts(sea: SeaState, now_ms: number | null): Fact[] {
  const facts: Fact[] = [];
  const period = sea.t_p_s ?? sea.t_z_s;
  if (period) facts.push({ name: 'Period', text: `${period.value.toFixed(1)} s` });
  const from = sea.directional;
  if (from) {
    facts.push({ name: 'From', text: `${compass(from.from_deg)}, ${from.from_deg.toFixed(0)}° ± ${from.from_error_deg.toFixed(0)}°` });
    facts.push({ name: 'Length', text: `${from.wavelength_peak_m.toFixed(1)} m` });
  }
  const probability = sea.verdict.probability;
  if (probability !== null && probability !== undefined) {
    // No measurement is surer than this.
    const percent = Math.min(99.9, Math.max(0.1, probability * 100));
    facts.push({ name: 'Under all limits', text: `${percent >= 99 || percent <= 1 ? percent.toFixed(1) : percent.toFixed(0)} % likely` });
  }
  const calm = sea.calm;
  if (calm && now_ms !== null) {
    const next = calm.windows.find((window) => Date.parse(window.to) > now_ms);
    if (next) {
      const in_s = (Date.parse(next.from) - now_ms) / 1000;
      const left_s = (Date.parse(next.to) - now_ms) / 1000;
      facts.push({ name: 'Quiet moment', text: in_s <= 0 ? `now, for ${left_s.toFixed(0)} s` : `in ${in_s.toFixed(0)} s` });
    }
  }
  const flags = sea.quality.filter((flag) => !flag.failed).map((flag) => flag.test.replaceAll('_', ' '));
  if (flags.length > 0) facts.push({ name: 'Suspect', text: flags.join(', ') });
  return facts;
}
