import { describe, expect, it } from 'vitest';
import { event, mission, sea, stamp, vehicle } from '../state/fixtures';
import { parseMessage } from './messages';

const wire = (type: string, data: unknown): string => JSON.stringify({ type, data });

describe('messages off the wire', () => {
  it.each([
    ['vehicle', vehicle()],
    ['sea_state', sea()],
    ['mission', mission()],
    ['event', event(1)],
    ['heartbeat', { now: stamp(0) }],
  ])('a whole %s passes', (type, data) => expect(parseMessage(wire(type, data))).toEqual({ type, data }));

  it.each(['', '{', 'null', '[]', '42', '"vehicle"', '{}', '{"type":7}', '{"type":"vehicle"}', '{"type":"vehicle","data":[]}'])(
    'never throws on %j',
    (text) => expect(parseMessage(text).type).toBe('invalid'),
  );

  it('lets a newer gateway say more', () => {
    expect(parseMessage(wire('weather', {}))).toEqual({ type: 'unknown', name: 'weather' });
    expect(parseMessage(wire('constructor', {}))).toEqual({ type: 'unknown', name: 'constructor' });
    expect(parseMessage(wire('vehicle', { ...vehicle(), colour: 'red' })).type).toBe('vehicle');
  });

  it.each([
    ['a vehicle nowhere', 'vehicle', { ...vehicle(), local: { north_m: null, east_m: 0, height_m: 0 } }],
    ['a vehicle of no time', 'vehicle', { ...vehicle(), stamp: 'yesterday' }],
    ['a verdict without an end', 'sea_state', { ...sea(), verdict: { state: 'safe', reasons: [], valid_until: null } }],
    ['half an estimate', 'sea_state', { ...sea(), h_s_m: { value: 0.1 } }],
    ['a trace with a hole', 'sea_state', { ...sea(), trace: [{ t_s: 0, elevation_m: null }] }],
    ['a mission without rules', 'mission', { ...mission(), can: { abort: { allowed: true, why: '' } } }],
  ])('refuses %s', (_, type, data) => expect(parseMessage(wire(type, data)).type).toBe('invalid'));
});
