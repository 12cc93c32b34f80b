/** Where vehicles have been: a bounded line each, thinned as it grows. Pure. */
import type { Place } from './projection';
import { distance_m } from './projection';

export interface TrailPoint extends Place {
  stamp_ms: number;
}

export type Trails = Readonly<Record<string, readonly TrailPoint[]>>;

/** Enough for ten minutes at walking pace. */
export const TRAIL_POINTS_MAX = 600;
/** Closer than this adds nothing to a line. */
const STEP_M = 0.4;
/** A longer silence, a jump, or a clock that went back begins a new line. */
const GAP_MS = 20_000;
const JUMP_M = 100;

export function extend(trail: readonly TrailPoint[], point: TrailPoint): readonly TrailPoint[] {
  const last = trail.at(-1);
  if (last === undefined) return [point];
  const moved_m = distance_m(last, point);
  if (point.stamp_ms < last.stamp_ms || point.stamp_ms - last.stamp_ms > GAP_MS || moved_m > JUMP_M) return moved_m < STEP_M ? trail : [point];
  return moved_m < STEP_M ? trail : [...trail, point].slice(-TRAIL_POINTS_MAX);
}
