/**
 * Everything the page knows, as a pure function of the messages heard. Messages may come twice, late or out of order:
 * older than what is known changes nothing. `hello` begins anew, since a full snapshot follows it.
 */
import type { Parsed } from '../api/messages';
import type { Event, Hello, Mission, Plan, SeaState, Service, Vehicle } from '../api/types';
import { observe, UNSET_CLOCK, type FleetClock } from './fleet-clock';

/** A value and when it was heard, milliseconds of this machine's clock. */
export interface Heard<T> {
  value: T;
  heard_ms: number;
}

export type Table<T> = Readonly<Record<string, Heard<T>>>;

export interface FleetState {
  hello: Hello | null;
  clock: FleetClock;
  vehicles: Table<Vehicle>;
  seas: Table<SeaState>;
  missions: Table<Mission>;
  services: Table<Service>;
  plan: Heard<Plan> | null;
  /** Newest last, at most {@link EVENTS_MAX}. */
  events: readonly Event[];
  /** Messages that changed nothing, and why; shown in the services panel, so that trouble is seen. */
  refused: Readonly<{ invalid: number; unknown: number; late: number; last: string }>;
}

export const EVENTS_MAX = 300;

export const EMPTY: FleetState = {
  hello: null,
  clock: UNSET_CLOCK,
  vehicles: {},
  seas: {},
  missions: {},
  services: {},
  plan: null,
  events: [],
  refused: { invalid: 0, unknown: 0, late: 0, last: '' },
};

/** The state after `message`, heard at `heard_ms`. */
export function reduce(state: FleetState, message: Parsed, heard_ms: number): FleetState {
  switch (message.type) {
    case 'hello':
      return { ...EMPTY, refused: state.refused, hello: message.data, clock: observe({ ...UNSET_CLOCK, nominal: Number.isFinite(message.data.speed) ? message.data.speed : 1 }, Date.parse(message.data.now), heard_ms) };
    case 'heartbeat':
      return { ...state, clock: observe(state.clock, Date.parse(message.data.now), heard_ms) };
    case 'vehicle':
      return put(state, 'vehicles', message.data.id, message.data, heard_ms);
    case 'sea_state':
      return put(state, 'seas', message.data.rig, message.data, heard_ms);
    case 'mission':
      return put(state, 'missions', message.data.id, message.data, heard_ms);
    case 'service':
      return put(state, 'services', message.data.instance, message.data, heard_ms);
    case 'plan':
      if (state.plan !== null && message.data.generation < state.plan.value.generation) return late(state, 'plan');
      return { ...state, plan: { value: message.data, heard_ms } };
    case 'event':
      return addEvent(state, message.data);
    case 'unknown':
      return { ...state, refused: { ...state.refused, unknown: state.refused.unknown + 1, last: `unknown message ${message.name}` } };
    case 'invalid':
      return { ...state, refused: { ...state.refused, invalid: state.refused.invalid + 1, last: message.why } };
  }
}

const late = (state: FleetState, what: string): FleetState => ({
  ...state,
  refused: { ...state.refused, late: state.refused.late + 1, last: `late ${what}` },
});

type TableName = 'vehicles' | 'seas' | 'missions' | 'services';

function put<T extends { stamp: string }>(state: FleetState, table: TableName, key: string, value: T, heard_ms: number): FleetState {
  const known = Object.hasOwn(state[table], key) ? state[table][key] : undefined;
  // Equal stamps pass: the same value again may carry a new judgement, such as `stale` or `can`.
  if (known !== undefined && Date.parse(value.stamp) < Date.parse(known.value.stamp)) return late(state, table);
  return { ...state, [table]: { ...state[table], [key]: { value, heard_ms } } };
}

function addEvent(state: FleetState, event: Event): FleetState {
  if (state.events.some((known) => known.sequence === event.sequence)) return state;
  const events = [...state.events, event].sort((a, b) => a.sequence - b.sequence).slice(-EVENTS_MAX);
  return { ...state, events };
}
