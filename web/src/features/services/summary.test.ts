import { expect, it } from 'vitest';
import type { Service } from '../../api/types';
import { stamp } from '../../state/fixtures';
import { groupServices, serviceTone } from './summary';

const service = (instance: string, over: Partial<Service> = {}): Service => ({
  instance, service: instance.split('.')[0] ?? '', state: 'ready', detail: '', restarts: 0, uptime_s: 1, version: '0', stamp: stamp(0), age_s: 0, stale: false, ...over,
});

it('a group is as bad as its worst member, and trouble comes first', () => {
  const groups = groupServices([service('capture.a'), service('vehicle-link.b', { state: 'restarting' }), service('vehicle-link.a')], true);
  expect(groups.map((group) => [group.service, group.tone])).toEqual([['vehicle-link', 'bad'], ['capture', 'ok']]);
  expect(groups[0]?.instances.map((one) => one.instance)).toEqual(['vehicle-link.a', 'vehicle-link.b']);
});

it('ready is not ok once it is silent, or the link is down', () => {
  expect(serviceTone(service('a'), true)).toBe('ok');
  expect(serviceTone(service('a', { stale: true }), true)).toBe('bad');
  expect(serviceTone(service('a'), false)).toBe('idle');
  expect(serviceTone(service('a', { state: 'starting' }), true)).toBe('warn');
});
