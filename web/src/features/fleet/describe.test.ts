import { describe, expect, it } from 'vitest';
import { T0, vehicle } from '../../state/fixtures';
import { activityText, activityTone, batteryTone, firmwareText, fixTone, inOrder, linkText, presence } from './describe';

const heard = (over = {}, heard_ms = 0) => ({ value: vehicle(over), heard_ms });

describe('presence', () => {
  it('is fresh while it speaks', () => expect(presence(heard(), true, T0 + 4000, 4000)).toBe('fresh'));
  it('is stale after 5 s', () => expect(presence(heard(), true, T0 + 5100, 5100)).toBe('stale'));
  it('is not stale by jitter when the fleet clock runs 20 times as fast', () => expect(presence(heard(), true, T0 + 8000, 400)).toBe('fresh'));
  it('is stale when the gateway says so', () => expect(presence(heard({ stale: true }), true, T0, 0)).toBe('stale'));
  it('is unknown without a link, however fresh', () => expect(presence(heard(), false, T0, 0)).toBe('unknown'));
  it('is unknown without a clock', () => expect(presence(heard(), true, null, 0)).toBe('unknown'));
});

describe('words', () => {
  const doing = (kind: string, over = {}) => vehicle({ activity: { kind: kind as 'idle', settled: null, slot_error_m: null, reason: null, ...over } });
  it.each([
    [doing('idle'), 'Ready', 'idle'],
    [{ ...doing('idle'), ready_to_arm: false }, 'Not ready', 'warn'],
    [doing('holding', { settled: false }), 'Settling', 'ok'],
    [doing('following', { settled: true, slot_error_m: 0.2 }), 'In slot', 'ok'],
    [doing('fail_safe', { reason: 'plan lapsed' }), 'Fail-safe', 'bad'],
    [doing('pilot_control'), 'Pilot in control', 'warn'],
    [doing('taking_off'), 'Taking off', 'ok'],
  ])('%#: %s', (one, text, tone) => {
    expect(activityText(one)).toBe(text);
    expect(activityTone(one)).toBe(tone);
  });

  it('an unknown battery is neither full nor empty', () => {
    expect(batteryTone(null)).toBe('idle');
    expect([80, 25, 10].map(batteryTone)).toEqual(['ok', 'warn', 'bad']);
  });

  it('a position that the estimator distrusts is bad whatever the receiver says', () => {
    expect(fixTone(vehicle())).toBe('ok');
    expect(fixTone(vehicle({ estimator_ok: false }))).toBe('bad');
    expect(fixTone(vehicle({ fix: null }))).toBe('idle');
    expect(fixTone(vehicle({ fix: { kind: '3d', satellites: 5, horizontal_sigma_m: 1 } }))).toBe('warn');
  });
});

describe('link and firmware', () => {
  const link = { loss_percent: 0.44, round_trip_ms: 12.3, received: 100, signed: false };
  const plain = (text: string) => text.replaceAll('\u00a0', ' ').replaceAll('\u202f', ' ');
  it('says what is known', () => {
    expect(plain(linkText(vehicle({ link })))).toBe('0.4 % lost, 12 ms');
    expect(plain(linkText(vehicle({ link: { ...link, loss_percent: 23.4, round_trip_ms: null, signed: true } })))).toBe('23 % lost, signed');
    const firmware = { autopilot: 'ArduPilot', vehicle: 'quadrotor', version: '4.6.0' };
    expect(firmwareText(vehicle({ firmware }))).toBe('ArduPilot 4.6.0 (quadrotor)');
    expect(firmwareText(vehicle({ firmware: { ...firmware, version: '' } }))).toBe('ArduPilot (quadrotor)');
  });
  it('is unknown until something was heard', () => expect([linkText(vehicle()), firmwareText(vehicle())]).toEqual(['–', '–']));
});

it('leaders come first, numbers in order', () => {
  const ids = ['follower-10', 'follower-2', 'leader-1'];
  const all = ids.map((id) => heard({ id, role: id.startsWith('leader') ? 'leader' : 'follower' }));
  expect(inOrder(all).map((one) => one.value.id)).toEqual(['leader-1', 'follower-2', 'follower-10']);
});
