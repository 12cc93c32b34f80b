/**
 * Text off the wire → a stream message, or the reason why it is none. What passes here is safe to draw: every number that
 * the map and the verdict rest on has been looked at. Nothing here throws.
 */
import type { StreamMessage } from './types';

/** A message; or `unknown` (a newer gateway's type, harmless); or `invalid` (not what the contract says). */
export type Parsed = StreamMessage | { type: 'unknown'; name: string } | { type: 'invalid'; why: string };

type Json = Record<string, unknown>;

const isObject = (value: unknown): value is Json => typeof value === 'object' && value !== null && !Array.isArray(value);
const isText = (value: unknown): value is string => typeof value === 'string';
const isNumber = (value: unknown): value is number => typeof value === 'number' && Number.isFinite(value);
const isStamp = (value: unknown): boolean => isText(value) && !Number.isNaN(Date.parse(value));
const isPlace = (value: unknown): boolean => isObject(value) && isNumber(value['north_m']) && isNumber(value['east_m']);
const isGlobal = (value: unknown): boolean => isObject(value) && isNumber(value['latitude_deg']) && isNumber(value['longitude_deg']);
const isNullOr = (value: unknown, check: (value: unknown) => boolean): boolean => value === null || value === undefined || check(value);
const isEstimate = (value: unknown): boolean =>
  isObject(value) && isNumber(value['value']) && isNumber(value['low']) && isNumber(value['high']);
const isEvery = (value: unknown, check: (value: unknown) => boolean): boolean => Array.isArray(value) && value.every(check);
const isPossibility = (value: unknown): boolean => isObject(value) && typeof value['allowed'] === 'boolean' && isText(value['why']);

/** For each type, the fields without which it cannot be shown. */
const CHECKS: Record<StreamMessage['type'], Record<string, (value: unknown) => boolean>> = {
  hello: { fleet: isText, origin: isGlobal, now: isStamp },
  heartbeat: { now: isStamp },
  vehicle: {
    id: isText,
    role: isText,
    stamp: isStamp,
    local: (value) => isPlace(value) && isNumber((value as Json)['height_m']),
    velocity: isObject,
    heading_deg: isNumber,
    mode: isText,
    landed: isText,
    activity: (value) => isObject(value) && isText(value['kind']),
    home: (value) => isNullOr(value, isGlobal),
    touchdown: (value) => isNullOr(value, isPlace),
  },
  sea_state: {
    rig: isText,
    stamp: isStamp,
    local: isPlace,
    h_s_m: (value) => isNullOr(value, isEstimate),
    trace: (value) => isEvery(value, (sample) => isObject(sample) && isNumber(sample['t_s']) && isNumber(sample['elevation_m'])),
    verdict: (value) =>
      isObject(value) &&
      isText(value['state']) &&
      isStamp(value['valid_until']) &&
      isEvery(value['reasons'], (reason) => isObject(reason) && isText(reason['text']) && typeof reason['passed'] === 'boolean'),
  },
  mission: {
    id: isText,
    name: isText,
    stamp: isStamp,
    phase: isText,
    point: isPlace,
    touchdown: (value) => isNullOr(value, isPlace),
    history: (value) => isEvery(value, (step) => isObject(step) && isStamp(step['stamp']) && isText(step['phase'])),
    can: (value) => isObject(value) && ['approve', 'dispatch', 'pause', 'resume', 'abort', 'release', 'skip_release'].every((key) => isPossibility(value[key])),
  },
  plan: {
    generation: isNumber,
    valid_until: isStamp,
    assignments: (value) =>
      isEvery(value, (one) => isObject(one) && isText(one['vehicle']) && isObject(one['task']) && isText(one['task']['kind'])),
  },
  service: { instance: isText, service: isText, state: isText, stamp: isStamp },
  event: { sequence: isNumber, stamp: isStamp, severity: isText, what: isText },
};

/** Reads one message. */
export function parseMessage(text: string): Parsed {
  let json: unknown;
  try {
    json = JSON.parse(text);
  } catch {
    return { type: 'invalid', why: 'not JSON' };
  }
  if (!isObject(json) || !isText(json['type'])) return { type: 'invalid', why: 'no type' };
  const name = json['type'];
  if (!Object.hasOwn(CHECKS, name)) return { type: 'unknown', name };
  const data = json['data'];
  if (!isObject(data)) return { type: 'invalid', why: `${name}: no data` };
  for (const [field, check] of Object.entries(CHECKS[name as StreamMessage['type']])) {
    if (!check(data[field])) return { type: 'invalid', why: `${name}: ${field} is missing or malformed` };
  }
  return { type: name, data } as unknown as StreamMessage;
}
