import { expect, it } from 'vitest';
import { fleetTime_ms, observe, rate, UNSET_CLOCK } from './fleet-clock';

it('knows nothing before it is told', () => expect(fleetTime_ms(UNSET_CLOCK, 5)).toBeNull());

it('runs on at the rate that it saw', () => {
  let clock = UNSET_CLOCK;
  for (let i = 0; i <= 5; i += 1) clock = observe(clock, 1_000_000 + 20_000 * i, 1000 * i);
  expect(rate(clock)).toBeCloseTo(20, 9);
  expect(fleetTime_ms(clock, 5500)).toBeCloseTo(1_100_000 + 10_000, 6);
});

it('runs at the nominal rate until it knows better', () => {
  const clock = observe({ ...UNSET_CLOCK, nominal: 8 }, 1000, 0);
  expect(fleetTime_ms(clock, 100)).toBe(1800);
  expect(rate(observe(clock, 5000, 1000))).toBe(4);
});

it('never runs slower than the wall, so that nothing looks fresher than it is', () => {
  const clock = observe(observe(UNSET_CLOCK, 0, 0), 100, 1000);
  expect(rate(clock)).toBe(1);
  expect(fleetTime_ms(clock, 3000)).toBe(2100);
});

it('starts over when the fleet clock jumps back, and stays bounded', () => {
  let clock = UNSET_CLOCK;
  for (let i = 0; i < 1000; i += 1) clock = observe(clock, i * 100, i * 100);
  expect(clock.readings.length).toBeLessThanOrEqual(30);
  expect(observe(clock, 5, 100_000).readings).toHaveLength(1);
});
