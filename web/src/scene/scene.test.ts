import { describe, expect, it } from 'vitest';
import type { PlanTask } from '../api/types';
import { mission, stamp, T0, vehicle } from '../state/fixtures';
import { EMPTY, reduce, type FleetState } from '../state/reduce';
import { compose, extent, type ComposeInput } from './compose';
import { globalFromPlace, placeFromGlobal } from './geodesy';
import { placeLabel, type Box } from './labels';
import { extend, TRAIL_POINTS_MAX, type TrailPoint } from './trails';

describe('geodesy', () => {
  // Metres in a degree at 45° by the series of Snyder, Map Projections (USGS PP 1395); the same values judge the Rust side.
  it('a degree at 45° has its published length', () => {
    const origin = { latitude_deg: 45, longitude_deg: 7 };
    expect(placeFromGlobal(origin, { latitude_deg: 45.001, longitude_deg: 7 }).north_m).toBeCloseTo(111.131_779, 2);
    expect(placeFromGlobal(origin, { latitude_deg: 45, longitude_deg: 7.001 }).east_m).toBeCloseTo(78.846_835, 2);
  });
  it('there and back within a kilometre, across the date line too', () => {
    for (const longitude_deg of [24.8, 179.9999, -179.9999]) {
      const origin = { latitude_deg: -33.2, longitude_deg };
      const back = placeFromGlobal(origin, globalFromPlace(origin, { north_m: 812, east_m: 577 }));
      expect(back.north_m).toBeCloseTo(812, 1);
      expect(back.east_m).toBeCloseTo(577, 1);
    }
  });
});

describe('trails', () => {
  const at = (east_m: number, stamp_ms: number): TrailPoint => ({ north_m: 0, east_m, stamp_ms });
  it('grow with movement, not with time', () => {
    let trail = extend([], at(0, 0));
    trail = extend(trail, at(0.1, 1000));
    expect(trail).toHaveLength(1);
    expect(extend(trail, at(1, 2000))).toHaveLength(2);
  });
  it('break at a silence, a jump and a clock that went back', () => {
    const trail = [at(0, 0), at(1, 1000)];
    expect(extend(trail, at(2, 40_000))).toHaveLength(1);
    expect(extend(trail, at(500, 2000))).toHaveLength(1);
    expect(extend(trail, at(2, 500))).toHaveLength(1);
  });
  it('are bounded', () => {
    let trail: readonly TrailPoint[] = [];
    for (let i = 0; i < TRAIL_POINTS_MAX + 100; i += 1) trail = extend(trail, at(i, i * 100));
    expect(trail).toHaveLength(TRAIL_POINTS_MAX);
  });
});

describe('what the map shows', () => {
  const input = (fleet: FleetState, over: Partial<ComposeInput> = {}): ComposeInput => ({
    fleet, live: true, fleetNow_ms: T0, now_ms: 0, selectedVehicle: null, mission: null, draft: null, water: null, ...over,
  });
  const fleetOf = (...all: ReturnType<typeof vehicle>[]): FleetState => all.reduce((state, data) => reduce(state, { type: 'vehicle', data }, 0), EMPTY);
  const withPlan = (state: FleetState, id: string, task: PlanTask): FleetState =>
    reduce(state, { type: 'plan', data: { generation: 1, stamp: stamp(0), age_s: 0, mission: 'm-1', valid_until: stamp(5), expired: false, assignments: [{ vehicle: id, task }] } }, 0);
  const leader = vehicle({ local: { north_m: 50, east_m: 20, height_m: 5 }, heading_deg: 90 });
  const follower = vehicle({ id: 'follower-1', role: 'follower', local: { north_m: 0, east_m: 0, height_m: 5 } });

  it('puts the slot to the right of the leader: south of one that heads east', () => {
    const state = withPlan(fleetOf(leader, follower), 'follower-1', { kind: 'follow', leader: 'leader-1', slot: { forward_m: 0, right_m: 7, up_m: 0 } });
    const scene = compose(input(state));
    expect(scene.slots[0]?.place.north_m).toBeCloseTo(43, 9);
    expect(scene.slots[0]?.place.east_m).toBeCloseTo(20, 9);
    expect(scene.errands).toHaveLength(1);
  });
  it('drops a slot whose leader is not known', () => {
    const state = withPlan(fleetOf(follower), 'follower-1', { kind: 'follow', leader: 'ghost', slot: { forward_m: 0, right_m: 7, up_m: 0 } });
    expect(compose(input(state)).slots).toEqual([]);
  });
  it('marks rings of vehicles that are too close, in three dimensions', () => {
    const near = vehicle({ id: 'follower-1', role: 'follower', local: { north_m: 53, east_m: 20, height_m: 5 } });
    const above = vehicle({ id: 'follower-1', role: 'follower', local: { north_m: 53, east_m: 20, height_m: 12 } });
    const grounded = vehicle({ id: 'follower-1', role: 'follower', landed: 'on_ground', local: { north_m: 53, east_m: 20, height_m: 5 } });
    expect(compose(input(fleetOf(leader, near))).rings.map((ring) => ring.close)).toEqual([true, true]);
    expect(compose(input(fleetOf(leader, above))).rings.map((ring) => ring.close)).toEqual([false, false]);
    expect(compose(input(fleetOf(leader, grounded))).rings).toHaveLength(1);
  });
  it('claims nothing without a link', () => {
    const scene = compose(input(fleetOf(leader, follower), { live: false }));
    expect(scene.vehicles.map((one) => [one.presence, one.caption])).toEqual([['unknown', 'Unknown'], ['unknown', 'Unknown']]);
  });
  it('colours a point by a verdict from near it only', () => {
    const state = reduce(EMPTY, { type: 'mission', data: mission() }, 0);
    const toneFrom = (north_m: number) => compose(input(state, { water: { tone: 'safe', place: { north_m, east_m: 20 } } })).missions[0]?.tone;
    expect(toneFrom(75)).toBe('safe');
    expect(toneFrom(85)).toBeNull();
  });
  it('hides ended missions unless one is selected', () => {
    const ended = mission({ phase: 'completed', touchdown: mission().point, touchdown_error_m: 0.3 });
    const state = reduce(EMPTY, { type: 'mission', data: ended }, 0);
    expect(compose(input(state)).missions).toEqual([]);
    const scene = compose(input(state, { mission: ended }));
    expect(scene.missions[0]?.state).toBe('selected');
    expect(scene.touchdowns).toHaveLength(1);
    expect(extent(scene)).toHaveLength(1);
  });
});

describe('labels', () => {
  it('take the first free side, and none where all are taken', () => {
    const taken: Box[] = [];
    const sides = [0, 1, 2, 3, 4].map(() => {
      const box = placeLabel(100, 100, 10, 40, 20, taken);
      if (box !== null) taken.push(box);
      return box;
    });
    expect(sides.map((box) => box && [Math.sign(box.x + 20 - 100), Math.sign(box.y + 10 - 100)])).toEqual([[1, 0], [-1, 0], [0, 1], [0, -1], null]);
  });
});
