import { describe, expect, it } from 'vitest';
import { sea as seaState } from '../../state/fixtures';
import { compass, seaFacts } from './facts';

const now_ms = Date.parse('2026-01-01T00:00:00Z');
const at = (s: number): string => new Date(now_ms + s * 1000).toISOString();

describe('sea facts', () => {
  it('names eight winds, over north too', () => {
    expect([0, 44, 90, 180, 271, 359, -1, 720].map(compass)).toEqual(['N', 'NE', 'E', 'S', 'W', 'N', 'N', 'N']);
  });

  it('leaves out what is not known', () => {
    const sea = { ...seaState(), t_p_s: null, t_z_s: null, directional: null, calm: null, quality: [] };
    expect(seaFacts({ ...sea, verdict: { ...sea.verdict, probability: null } }, now_ms)).toEqual([]);
  });

  it('says from where, how long, how likely, and when it is quiet', () => {
    const sea = seaState();
    const facts = seaFacts(
      {
        ...sea,
        t_p_s: { value: 1.31, low: 1.2, high: 1.5 },
        directional: { from_deg: 240.4, from_error_deg: 6.2, spread_deg: 24, wavelength_peak_m: 2.68 },
        calm: {
          local: sea.local,
          from: at(0),
          error_share: 0.6,
          windows: [{ from: at(-9), to: at(-7) }, { from: at(3.2), to: at(6) }],
        },
        quality: [{ test: 'energy_high', failed: false, text: '' }],
        verdict: { ...sea.verdict, probability: 0.99996 },
      },
      now_ms,
    );
    expect(Object.fromEntries(facts.map(({ name, text }) => [name, text]))).toEqual({
      Period: '1.3 s',
      From: 'SW, 240° ± 6°',
      Length: '2.7 m',
      'Under all limits': '99.9 % likely',
      'Quiet moment': 'in 3 s',
      Suspect: 'energy high',
    });
  });
});
