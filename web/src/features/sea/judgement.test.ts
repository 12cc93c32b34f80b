import { describe, expect, it } from 'vitest';
import type { SeaState } from '../../api/types';
import { mission, sea, stamp, T0 } from '../../state/fixtures';
import type { LinkPhase } from '../../state/link';
import { chooseRig, judge } from './judgement';

const heard = (over: Partial<SeaState> = {}) => ({ value: sea(over), heard_ms: 0 });
const verdict = (over: Partial<SeaState['verdict']>): Partial<SeaState> => ({ verdict: { ...sea().verdict, ...over } });

describe('green', () => {
  it('is for a fresh safe verdict, and counts down', () => {
    expect(judge(heard(), 'live', T0 + 2000)).toMatchObject({ tone: 'safe', left_s: 8 });
  });

  it.each<[string, ReturnType<typeof heard> | undefined, LinkPhase, number | null]>([
    ['nothing was ever heard', undefined, 'live', T0],
    ['the link is lost', heard(), 'lost', T0],
    ['the link is silent', heard(), 'silent', T0],
    ['the link is not up yet', heard(), 'connecting', T0],
    ['the fleet clock is not known', heard(), 'live', null],
    ['its time is up by the clock', heard(), 'live', T0 + 10_000],
    ['the gateway says expired', heard(verdict({ expired: true })), 'live', T0],
    ['its end cannot be read', heard(verdict({ valid_until: 'soon' })), 'live', T0],
    ['the rig is silent', heard({ stale: true }), 'live', T0],
    ['it is inconclusive', heard(verdict({ state: 'inconclusive' })), 'live', T0],
    ['it is unsafe', heard(verdict({ state: 'unsafe' })), 'live', T0],
    ['it is a word from the future', heard(verdict({ state: 'calm' as 'safe' })), 'live', T0],
  ])('is never shown when %s', (_, value, phase, now) => expect(judge(value, phase, now).tone).not.toBe('safe'));
});

it('an unsafe verdict that ran out is not known, not unsafe for ever', () => {
  expect(judge(heard(verdict({ state: 'unsafe' })), 'live', T0 + 11_000)).toMatchObject({ tone: 'unknown', title: 'Expired' });
});

describe('which rig', () => {
  const at = (rig: string, north_m: number, at_s: number) => ({ [rig]: heard({ rig, stamp: stamp(at_s), local: { ...sea().local, north_m } }) });
  const seas = { ...at('leader-1', 0, 5), ...at('leader-2', 60, 1), ...at('buoy', 500, 9) };
  it('asked for', () => expect(chooseRig(seas, 'buoy', mission({ leader: 'leader-1' }))).toBe('buoy'));
  it('the leader of the mission', () => expect(chooseRig(seas, 'gone', mission({ leader: 'leader-1' }))).toBe('leader-1'));
  it('the nearest to the point', () => expect(chooseRig(seas, null, mission())).toBe('leader-2'));
  it('the newest', () => expect(chooseRig(seas, null, null)).toBe('buoy'));
  it('none', () => expect(chooseRig({}, null, null)).toBeNull());
});
