/** What the map shows, from what the page knows: places and words, no pixels. Pure. */
import type { Mission, PlanTask, Vehicle } from '../api/types';
import { activityText, inOrder, isAirborne, presence, type Presence } from '../features/fleet/describe';
import { isFinal } from '../features/missions/can';
import { length } from '../lib/format';
import type { FleetState } from '../state/reduce';
import { placeFromGlobal } from './geodesy';
import { distance_m, slotPlace, type Place } from './projection';

/** The thesis's minimum separation between vehicles, drawn about each that flies. */
export const SEPARATION_M = 5;

export interface DrawnVehicle {
  id: string;
  role: Vehicle['role'];
  place: Place;
  heading_deg: number;
  airborne: boolean;
  presence: Presence;
  selected: boolean;
  alarm: boolean;
  /** Under the name. */
  caption: string;
}

export interface Composition {
  vehicles: DrawnVehicle[];
  homes: Place[];
  /** Broken lines from a vehicle to where the plan sends it. */
  errands: { from: Place; to: Place; role: Vehicle['role'] }[];
  slots: { place: Place; of: string }[];
  rings: { place: Place; radius_m: number; close: boolean }[];
  missions: { place: Place; name: string; state: 'active' | 'selected'; tone: 'safe' | 'unsafe' | null }[];
  touchdowns: { place: Place; caption: string }[];
  draft: Place | null;
}

export interface ComposeInput {
  fleet: FleetState;
  live: boolean;
  fleetNow_ms: number | null;
  now_ms: number;
  selectedVehicle: string | null;
  mission: Mission | null;
  draft: Place | null;
  /** What is known of the water, and where. */
  water: { tone: 'safe' | 'unsafe'; place: Place } | null;
}

/** A verdict says something about a point this near to where it was measured. */
const VERDICT_REACH_M = 20;

export function compose(input: ComposeInput): Composition {
  const { fleet, live, fleetNow_ms, now_ms, mission } = input;
  const heard = inOrder(Object.values(fleet.vehicles));
  const flying = heard.map((one) => one.value).filter(isAirborne);
  const tasks = fleet.plan?.value.assignments ?? [];
  const placeOf = (id: string): Vehicle | undefined => fleet.vehicles[id]?.value;
  const origin = fleet.hello?.origin;

  return {
    vehicles: heard.map((one) => drawn(one.value, presence(one, live, fleetNow_ms, now_ms), one.value.id === input.selectedVehicle)),
    homes:
      origin === undefined
        ? []
        : heard.flatMap(({ value }) => (value.home === null || value.home === undefined ? [] : [placeFromGlobal(origin, value.home)])),
    errands: live
      ? tasks.flatMap(({ vehicle, task }) => {
          const from = placeOf(vehicle);
          const to = target(task, placeOf);
          return from === undefined || to === null || !isAirborne(from) || distance_m(from.local, to) < 1
            ? []
            : [{ from: from.local, to, role: from.role }];
        })
      : [],
    slots: tasks.flatMap(({ vehicle, task }) => {
      const place = task.kind === 'follow' ? target(task, placeOf) : null;
      return place === null ? [] : [{ place, of: vehicle }];
    }),
    rings: flying.map((one) => ({
      place: one.local,
      radius_m: SEPARATION_M,
      close: flying.some((other) => other.id !== one.id && apart_m(one, other) < SEPARATION_M),
    })),
    missions: Object.values(fleet.missions)
      .map(({ value }) => value)
      .filter((one) => one.id === mission?.id || !isFinal(one))
      .map((one) => ({ place: one.point, name: one.name, state: one.id === mission?.id ? 'selected' : 'active', tone: toneAt(one, input.water) })),
    touchdowns: mission?.touchdown
      ? [{ place: mission.touchdown, caption: mission.touchdown_error_m === null ? 'Touchdown' : `Touchdown ${length(mission.touchdown_error_m)} off` }]
      : [],
    draft: input.draft,
  };
}

/** Everything that "fit" must show. */
export const extent = (scene: Composition): Place[] => [
  ...scene.vehicles.map((one) => one.place),
  ...scene.missions.map((one) => one.place),
  ...scene.slots.map((one) => one.place),
  ...(scene.draft === null ? [] : [scene.draft]),
];

const toneAt = (mission: Mission, water: ComposeInput['water']): 'safe' | 'unsafe' | null =>
  water === null || isFinal(mission) || distance_m(water.place, mission.point) > VERDICT_REACH_M ? null : water.tone;

const apart_m = (a: Vehicle, b: Vehicle): number => Math.hypot(distance_m(a.local, b.local), a.local.height_m - b.local.height_m);

function drawn(vehicle: Vehicle, seen: Presence, selected: boolean): DrawnVehicle {
  const airborne = isAirborne(vehicle);
  const doing = seen === 'fresh' ? activityText(vehicle) : seen === 'stale' ? 'Silent' : 'Unknown';
  return {
    id: vehicle.id,
    role: vehicle.role,
    place: vehicle.local,
    heading_deg: vehicle.heading_deg,
    airborne,
    presence: seen,
    selected,
    alarm: vehicle.activity.kind === 'fail_safe',
    caption: airborne && seen === 'fresh' ? `${length(vehicle.local.height_m)} · ${doing}` : doing,
  };
}

function target(task: PlanTask, vehicle: (id: string) => Vehicle | undefined): Place | null {
  switch (task.kind) {
    case 'survey':
    case 'land':
      return task.point;
    case 'follow': {
      const leader = vehicle(task.leader);
      return leader === undefined ? null : slotPlace(leader.local, leader.heading_deg, task.slot.forward_m, task.slot.right_m);
    }
    default:
      return null;
  }
}
