import { describe, expect, it } from 'vitest';
import type { Parsed } from '../api/messages';
import { event, mission, sea, stamp, T0, vehicle } from './fixtures';
import { EMPTY, EVENTS_MAX, reduce, type FleetState } from './reduce';

const after = (...messages: Parsed[]): FleetState => messages.reduce((state, message, i) => reduce(state, message, i), EMPTY);
const hello: Parsed = {
  type: 'hello',
  data: { api: 'v1', version: '0.1.0', fleet: 'test', origin: { latitude_deg: 60, longitude_deg: 24, altitude_m: 0 }, now: stamp(0), speed: 1 },
};

describe('what the page knows', () => {
  it('keeps the newest, whatever the order', () => {
    const state = after(
      { type: 'vehicle', data: vehicle({ stamp: stamp(2), mode: 'LAND' }) },
      { type: 'vehicle', data: vehicle({ stamp: stamp(1), mode: 'GUIDED' }) },
    );
    expect(state.vehicles['leader-1']?.value.mode).toBe('LAND');
    expect(state.refused.late).toBe(1);
  });

  it('takes the same stamp again, since a judgement may have changed', () => {
    const state = after({ type: 'vehicle', data: vehicle() }, { type: 'vehicle', data: vehicle({ stale: true }) });
    expect(state.vehicles['leader-1']?.value.stale).toBe(true);
    expect(state.vehicles['leader-1']?.heard_ms).toBe(1);
  });

  it('refuses an older plan by its number, not its time', () => {
    const plan = (generation: number, at_s: number): Parsed => ({
      type: 'plan',
      data: { generation, stamp: stamp(at_s), age_s: 0, mission: null, valid_until: stamp(at_s + 5), expired: false, assignments: [] },
    });
    expect(after(plan(7, 0), plan(6, 1)).plan?.value.generation).toBe(7);
    expect(after(plan(7, 0), plan(8, -1)).plan?.value.generation).toBe(8);
  });

  it('keeps vehicles and rigs apart, and leaves untouched tables identical', () => {
    const one = after({ type: 'vehicle', data: vehicle() }, { type: 'sea_state', data: sea() }, { type: 'mission', data: mission() });
    const two = reduce(one, { type: 'vehicle', data: vehicle({ id: 'follower-1' }) }, 9);
    expect(Object.keys(two.vehicles)).toEqual(['leader-1', 'follower-1']);
    expect(two.seas).toBe(one.seas);
    expect(two.missions).toBe(one.missions);
  });

  it('sorts events, drops repeats, and is bounded', () => {
    const state = after({ type: 'event', data: event(3) }, { type: 'event', data: event(1) }, { type: 'event', data: event(3) });
    expect(state.events.map((one) => one.sequence)).toEqual([1, 3]);
    const many = Array.from({ length: EVENTS_MAX + 50 }, (_, i): Parsed => ({ type: 'event', data: event(i) }));
    const full = after(...many);
    expect(full.events).toHaveLength(EVENTS_MAX);
    expect(full.events.at(-1)?.sequence).toBe(EVENTS_MAX + 49);
  });

  it('counts what it cannot use and changes nothing else', () => {
    const before = after({ type: 'vehicle', data: vehicle() });
    const state = reduce(reduce(before, { type: 'invalid', why: 'not JSON' }, 1), { type: 'unknown', name: 'weather' }, 2);
    expect(state.refused).toMatchObject({ invalid: 1, unknown: 1 });
    expect(state.vehicles).toBe(before.vehicles);
  });

  it('begins anew with hello, even when the fleet clock went back', () => {
    const later = after({ type: 'vehicle', data: vehicle({ stamp: stamp(5000) }) });
    const state = reduce(reduce(later, hello, 10), { type: 'vehicle', data: vehicle({ stamp: stamp(1) }) }, 11);
    expect(Date.parse(state.vehicles['leader-1']?.value.stamp ?? '')).toBe(T0 + 1000);
  });

  it('holds ids that look like parts of an object', () => {
    const state = after({ type: 'vehicle', data: vehicle({ id: '__proto__' }) }, { type: 'vehicle', data: vehicle({ id: 'constructor' }) });
    expect(Object.keys(state.vehicles).sort()).toEqual(['__proto__', 'constructor']);
  });
});
