import { describe, expect, it } from 'vitest';
import type { Mission, MissionPhase } from '../../api/types';
import { mission, stamp } from '../../state/fixtures';
import { can, offered } from './can';
import { checkForm } from './form';
import { chooseMission, lastActivePhase, steps } from './progress';

const yes = { allowed: true, why: '' };
const history = (...phases: MissionPhase[]): Mission['history'] => phases.map((phase, i) => ({ stamp: stamp(i), phase, who: 'planner', why: '' }));

describe('buttons', () => {
  it('follow the rules that came with the mission, and say why not', () => {
    const one = mission({ can: { ...mission().can, approve: yes, pause: { allowed: false, why: 'already paused' } } });
    expect(can(one, 'approve', true)).toEqual(yes);
    expect(can(one, 'pause', true)).toEqual({ allowed: false, why: 'already paused' });
  });
  it('do nothing without a link, whatever the rules said last', () => {
    const one = mission({ can: { ...mission().can, approve: yes, abort: yes } });
    for (const action of ['approve', 'abort'] as const) expect(can(one, action, false).allowed).toBe(false);
  });
  it('a disabled one always has a reason', () => {
    const silent = { allowed: false, why: '' };
    expect(can(mission({ can: { ...mission().can, abort: silent } }), 'abort', true).why).not.toBe('');
  });
  it('abort is offered until the end', () => {
    for (const phase of ['waiting', 'transit', 'assessing', 'awaiting_approval', 'landing', 'paused'] as const) {
      expect(offered(mission({ phase }))).toContain('abort');
    }
    expect(offered(mission({ phase: 'paused' }))).toContain('resume');
    for (const phase of ['completed', 'aborted', 'failed'] as const) expect(offered(mission({ phase }))).toEqual([]);
  });
  it('approval is announced from the start, and gone once given', () => {
    expect(offered(mission({ phase: 'assessing' }))).toEqual(['approve', 'pause', 'abort']);
    expect(offered(mission({ phase: 'landing' }))).toEqual(['pause', 'abort']);
    const allowed = { allowed: true, why: '' };
    const held = mission({ phase: 'releasing', release_problem: 'refused' });
    expect(offered({ ...held, can: { ...held.can, release: allowed, skip_release: allowed } })).toEqual(['release', 'skip_release', 'pause', 'abort']);
    expect(offered(held)).toEqual(['pause', 'abort']);
    expect(offered(mission({ phase: 'assessing', approval: 'automatic' }))).toEqual(['pause', 'abort']);
  });
  it('dispatch replaces approve once only that is left', () => {
    expect(offered(mission({ phase: 'approved', can: { ...mission().can, dispatch: yes } }))[0]).toBe('dispatch');
    expect(offered(mission({ phase: 'awaiting_approval', can: { ...mission().can, dispatch: yes, approve: yes } }))[0]).toBe('approve');
  });
});

describe('steps', () => {
  it('advance', () => {
    expect(steps(mission({ phase: 'joining' })).map((step) => step.state)).toEqual(['done', 'done', 'done', 'current', 'ahead', 'ahead']);
    expect(steps(mission({ phase: 'completed' })).every((step) => step.state === 'done')).toBe(true);
  });
  it('stop where the mission stopped', () => {
    const one = mission({ phase: 'aborted', history: history('waiting', 'transit', 'assessing', 'paused', 'aborted') });
    expect(lastActivePhase(one)).toBe('assessing');
    expect(steps(one)[1]?.state).toBe('stopped');
  });
});

describe('which mission', () => {
  const old = mission({ id: 'old', phase: 'completed', history: history('waiting') });
  const running = mission({ id: 'running', phase: 'landing', history: [{ stamp: stamp(50), phase: 'waiting', who: '', why: '' }] });
  const newest = mission({ id: 'newest', phase: 'failed', history: [{ stamp: stamp(90), phase: 'waiting', who: '', why: '' }] });
  it('asked for', () => expect(chooseMission([old, running], 'old')?.id).toBe('old'));
  it('under way', () => expect(chooseMission([old, running, newest], null)?.id).toBe('running'));
  it('newest', () => expect(chooseMission([old, newest], 'gone')?.id).toBe('newest'));
  it('none', () => expect(chooseMission([], null)).toBeNull());
});

describe('the form', () => {
  const text = { name: ' Bay ', north: '60', east: '-20,5', height: '5', approval: 'manual' as const, leader: '', follower: 'follower-1' };
  it('becomes a request', () => {
    expect(checkForm(text)).toEqual({
      ok: true,
      mission: { point: { north_m: 60, east_m: -20.5 }, name: 'Bay', survey_height_m: 5, approval: 'manual', dispatch_on_approval: true, follower: 'follower-1' },
    });
  });
  it.each([
    [{ north: '' }, 'north'],
    [{ north: 'abc' }, 'north'],
    [{ east: '1e9' }, 'east'],
    [{ height: '0' }, 'height'],
    [{ height: '-3' }, 'height'],
    [{ height: 'Infinity' }, 'height'],
    [{ name: 'x'.repeat(201) }, 'name'],
  ])('%j is refused at its field', (over, field) => {
    const result = checkForm({ ...text, ...over });
    expect(result.ok).toBe(false);
    expect(!result.ok && Object.keys(result.errors)).toEqual([field]);
  });
});
