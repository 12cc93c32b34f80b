/**
 * What time it is on the fleet's clock, which in simulation runs faster than the wall. The gateway says so every second;
 * between two such messages the clock runs on at the rate last seen, never slower than the wall, so that nothing looks
 * fresher than it is.
 */

/** Readings, oldest first. Immutable. */
export interface FleetClock {
  readings: readonly { fleet_ms: number; wall_ms: number }[];
  /** How fast it is meant to run; holds until the readings tell how fast it does. */
  nominal: number;
}

export const UNSET_CLOCK: FleetClock = { readings: [], nominal: 1 };

/** Readings older than this no longer count for the rate. */
const WINDOW_MS = 10_000;

/** The clock after the gateway said `fleet_ms` at `wall_ms` of this machine. */
export function observe(clock: FleetClock, fleet_ms: number, wall_ms: number): FleetClock {
  const last = clock.readings.at(-1);
  // The fleet's clock jumped back (a simulation began anew): the old readings mean nothing.
  if (last !== undefined && fleet_ms < last.fleet_ms) return { ...clock, readings: [{ fleet_ms, wall_ms }] };
  return { ...clock, readings: [...clock.readings.filter((reading) => wall_ms - reading.wall_ms < WINDOW_MS), { fleet_ms, wall_ms }].slice(-30) };
}

/** Fleet seconds per second of the wall, at least 1. */
export function rate(clock: FleetClock): number {
  const first = clock.readings[0];
  const last = clock.readings.at(-1);
  if (first === undefined || last === undefined || last.wall_ms - first.wall_ms < 500) return Math.max(1, clock.nominal);
  return Math.max(1, (last.fleet_ms - first.fleet_ms) / (last.wall_ms - first.wall_ms));
}

/** The fleet's time at `wall_ms`; `null` before the first reading. */
export function fleetTime_ms(clock: FleetClock, wall_ms: number): number | null {
  const last = clock.readings.at(-1);
  return last === undefined ? null : last.fleet_ms + rate(clock) * Math.max(0, wall_ms - last.wall_ms);
}
