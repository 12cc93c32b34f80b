import { expect, it } from 'vitest';
import { parseMessage } from '../src/api/messages';
import { faults } from './contract.mjs';
import { World } from './world.mjs';

const fly = (world, seconds, until) => {
  for (let t = 0; t < seconds * 10 && !until(); t += 1) world.step(0.1);
};

it('the mock speaks the contract in every phase, and its mission ends', () => {
  const world = new World({ start_ms: Date.parse('2026-06-01T10:00:00Z') });
  world.create({ point: { north_m: 30, east_m: 10 } });
  const mission = [...world.missions.values()][0];
  const seen = new Set();
  const check = (type, data) => {
    const message = JSON.parse(JSON.stringify({ type, data }));
    expect(faults('StreamMessage', message), `${type} in ${mission.phase}`).toEqual([]);
    expect(parseMessage(JSON.stringify(message)).type, `${type} in ${mission.phase}`).toBe(type);
  };
  fly(world, 600, () => {
    if (!seen.has(mission.phase)) {
      seen.add(mission.phase);
      for (const one of world.vehicles) check('vehicle', world.vehicleJson(one));
      for (const one of world.seas()) check('sea_state', one);
      for (const one of world.services()) check('service', one);
      check('mission', world.missionJson(mission));
      check('plan', world.plan());
      check('hello', world.hello());
      for (const one of world.events) check('event', one);
      if (mission.phase === 'awaiting_approval') world.command(mission.id, 'approve');
    }
    return mission.phase === 'completed';
  });
  expect(mission.history.map((step) => step.phase)).toEqual(['waiting', 'transit', 'assessing', 'awaiting_approval', 'approved', 'joining', 'clearing', 'landing', 'completed']);
});

it('rough water fails the mission', () => {
  const world = new World({ h_s_m: 0.3 });
  world.create({ point: { north_m: 30, east_m: 10 } });
  const mission = [...world.missions.values()][0];
  fly(world, 600, () => mission.phase === 'failed');
  expect(mission.phase).toBe('failed');
});

it('the judge finds faults', () => {
  expect(faults('Estimate', { value: 1, low: 1, high: 1 })).toEqual([]);
  expect(faults('Estimate', { value: 1, low: 'x', more: 1 })).toEqual(['Estimate.high is missing', 'Estimate.more is not in the contract', 'Estimate.low: string instead of number']);
  expect(faults('StreamMessage', { type: 'heartbeat', data: { now: 5 } })).not.toEqual([]);
});
