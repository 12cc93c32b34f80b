import { expect, it } from 'vitest';
import { backoff_ms } from './backoff';
import { readSelection, writeSelection } from './url-state';

it('an address goes there and back', () => {
  const query = '?mission=m-1&vehicle=leader-1&tab=fleet';
  expect(writeSelection(readSelection(query))).toBe(query);
  expect(writeSelection(readSelection(''))).toBe('');
});

it('ignores what cannot be an id', () => {
  expect(readSelection('?mission=../../etc&vehicle=%3Cb%3E&tab=root')).toEqual({ mission: null, vehicle: null, rig: null, tab: 'mission' });
});

it('backs off up to a bound and never to nothing', () => {
  expect(backoff_ms(0, 0)).toBe(500);
  expect(backoff_ms(3, 0)).toBe(4000);
  expect(backoff_ms(1e9, 0)).toBe(8000);
  expect(backoff_ms(0, 0.999)).toBeGreaterThan(400);
});
