/** A vehicle in words and tones. Pure. */
import type { Vehicle } from '../../api/types';
import { length, percent, quantity, UNKNOWN, words } from '../../lib/format';
import type { Heard } from '../../state/reduce';

export type Tone = 'ok' | 'warn' | 'bad' | 'idle';

/** Whether what a vehicle said last still describes it. */
export type Presence = 'fresh' | 'stale' | 'unknown';

/** Older than this on the fleet's clock, a state is history (thesis: no message for 5 s ends the following). */
const STALE_S = 5;
/** However fast the fleet's clock runs, this much silence on the wall's is no more than jitter. */
const JITTER_MS = 1500;

/** Seconds since the vehicle's position was measured. */
export function age_s(vehicle: Vehicle, fleetNow_ms: number | null): number | null {
  return fleetNow_ms === null ? null : Math.max(0, (fleetNow_ms - Date.parse(vehicle.stamp)) / 1000);
}

export function presence(heard: Heard<Vehicle>, live: boolean, fleetNow_ms: number | null, now_ms: number): Presence {
  const old_s = age_s(heard.value, fleetNow_ms);
  if (!live || old_s === null) return 'unknown';
  const silent = old_s > STALE_S && now_ms - heard.heard_ms > JITTER_MS;
  return heard.value.stale || silent ? 'stale' : 'fresh';
}

export const isAirborne = (vehicle: Vehicle): boolean =>
  vehicle.landed === 'in_air' || vehicle.landed === 'taking_off' || vehicle.landed === 'landing';

/** What it is doing, in at most four words. */
export function activityText({ activity, ready_to_arm }: Vehicle): string {
  switch (activity.kind) {
    case 'idle':
      return ready_to_arm ? 'Ready' : 'Not ready';
    case 'holding':
      return activity.settled === true ? 'Holding' : 'Settling';
    case 'following':
      return activity.settled === true ? 'In slot' : activity.slot_error_m === null ? 'Joining slot' : `${length(activity.slot_error_m)} from slot`;
    case 'fail_safe':
      return 'Fail-safe';
    case 'pilot_control':
      return 'Pilot in control';
    case 'transit':
      return 'Under way';
    default:
      return words(activity.kind);
  }
}

/** `following` → `In slot`; whether it needs attention. */
export function activityTone({ activity, ready_to_arm }: Vehicle): Tone {
  if (activity.kind === 'fail_safe') return 'bad';
  if (activity.kind === 'pilot_control') return 'warn';
  if (activity.kind === 'idle') return ready_to_arm ? 'idle' : 'warn';
  return 'ok';
}

export function batteryTone(percent: number | null): Tone {
  if (percent === null) return 'idle';
  return percent < 20 ? 'bad' : percent < 30 ? 'warn' : 'ok';
}

export function fixTone(vehicle: Vehicle): Tone {
  if (vehicle.fix === null) return 'idle';
  if (!vehicle.estimator_ok || ['no_gps', 'no_fix', '2d'].includes(vehicle.fix.kind)) return 'bad';
  return vehicle.fix.satellites < 8 || (vehicle.fix.horizontal_sigma_m ?? 0) > 3 ? 'warn' : 'ok';
}

/** `0.4 % lost, 12 ms`; a number that is not known is left out. */
export function linkText({ link }: Vehicle): string {
  if (link === null) return UNKNOWN;
  const lost = link.loss_percent < 10 ? quantity(link.loss_percent, 1, '%') : percent(link.loss_percent);
  const trip = link.round_trip_ms === null ? '' : `, ${quantity(link.round_trip_ms, 0, 'ms')}`;
  return `${lost} lost${trip}${link.signed ? ', signed' : ''}`;
}

/** `ArduPilot 4.6.0 (quadrotor)`. */
export function firmwareText({ firmware }: Vehicle): string {
  if (firmware === null) return UNKNOWN;
  return `${[firmware.autopilot, firmware.version].filter((part) => part !== '').join(' ')} (${firmware.vehicle})`;
}

/** Leaders first, then by name, with numbers in order: `follower-2` before `follower-10`. */
export function inOrder(vehicles: readonly Heard<Vehicle>[]): Heard<Vehicle>[] {
  return vehicles.toSorted(
    (a, b) =>
      Number(a.value.role !== 'leader') - Number(b.value.role !== 'leader') ||
      a.value.id.localeCompare(b.value.id, 'en', { numeric: true }),
  );
}
