/** The page's signals: what is known, over which link, and what time it is. Components read; only this file writes. */
import { computed, signal, type ReadonlySignal } from '@preact/signals';
import { openStream } from '../api/stream';
import type { Event } from '../api/types';
import { fleetTime_ms } from './fleet-clock';
import { linkPhase, NO_LINK, type Link, type LinkPhase } from './link';
import { EMPTY, reduce, type FleetState } from './reduce';

const state = signal<FleetState>(EMPTY);
const linkState = signal<Link>(NO_LINK);

/** This machine's time, four times a second: what ages and countdowns follow. */
export const now_ms = signal(Date.now());

export const link: ReadonlySignal<Link> = linkState;
export const phase: ReadonlySignal<LinkPhase> = computed(() => linkPhase(linkState.value, now_ms.value));
/** Whether what is shown may be believed. */
export const live: ReadonlySignal<boolean> = computed(() => phase.value === 'live');
export const fleet: ReadonlySignal<FleetState> = state;
export const vehicles = computed(() => state.value.vehicles);
export const seas = computed(() => state.value.seas);
export const missions = computed(() => state.value.missions);
export const services = computed(() => state.value.services);
export const plan = computed(() => state.value.plan);
export const events = computed(() => state.value.events);
export const hello = computed(() => state.value.hello);
/** The fleet's time; `null` until the gateway has said. */
export const fleetNow_ms = computed(() => fleetTime_ms(state.value.clock, now_ms.value));

/** An event's name here: a gateway that restarted counts from the start again, so that the number alone would not do. */
export const eventKey = (event: Event): string => `${event.sequence} ${event.stamp}`;

/** Alarms that a person has seen. */
const acknowledged = signal<ReadonlySet<string>>(new Set());
/** Critical events that nobody has acknowledged, newest first. */
export const alarms = computed<readonly Event[]>(() =>
  state.value.events.filter((event) => event.severity === 'critical' && !acknowledged.value.has(eventKey(event))).reverse(),
);
/** A person has seen every alarm that is shown now. */
export const acknowledge = (): void => {
  acknowledged.value = new Set([...acknowledged.peek(), ...alarms.peek().map(eventKey)]);
};

/** Connects and keeps time. Returns what tries again at once. */
export function start(): () => void {
  setInterval(() => {
    now_ms.value = Date.now();
  }, 250);
  const url = `${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/api/v1/stream`;
  const stream = openStream(url, {
    trying: () => (linkState.value = { ...linkState.value, open: false, retryAt_ms: null }),
    opened: () => (linkState.value = { ...linkState.value, open: true, everOpen: true, heard_ms: Date.now(), retryAt_ms: null }),
    closed: (retryAt_ms) => (linkState.value = { ...linkState.value, open: false, retryAt_ms }),
    messages: (batch) => {
      let next = state.value;
      let heard_ms = linkState.value.heard_ms;
      for (const one of batch) {
        next = reduce(next, one.message, one.heard_ms);
        heard_ms = one.heard_ms;
      }
      state.value = next;
      linkState.value = { ...linkState.value, heard_ms };
      now_ms.value = Date.now();
    },
  });
  return stream.retry;
}
