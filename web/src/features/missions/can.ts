/**
 * Which buttons there are, and why one is disabled. The rules themselves are the gateway's (`gateway/src/core/can.rs`, sent
 * along with every mission) and in the end the planner's; here is only what the page adds: without a live link, nothing.
 */
import type { MissionAction } from '../../api/client';
import type { Mission, MissionPhase, Possibility } from '../../api/types';

const yes: Possibility = { allowed: true, why: '' };
const no = (why: string): Possibility => ({ allowed: false, why });

const FINAL: readonly MissionPhase[] = ['completed', 'aborted', 'failed'];

export const isFinal = (mission: Mission): boolean => FINAL.includes(mission.phase);

/** Whether `action` can be asked for now. */
export function can(mission: Mission, action: MissionAction, live: boolean): Possibility {
  if (!live) return no('Not connected to the gateway');
  const possibility = mission.can[action];
  return possibility.allowed || possibility.why !== '' ? possibility : no('Not possible in this phase');
}

/** Whether a mission can be created now. */
export const canCreate = (live: boolean): Possibility => (live ? yes : no('Not connected to the gateway'));

/** The buttons worth showing, the likeliest first. Abort is always there until the end. */
export function offered(mission: Mission): MissionAction[] {
  if (isFinal(mission)) return [];
  const rest: MissionAction = mission.phase === 'paused' ? 'resume' : 'pause';
  const needsDispatch = mission.can.dispatch.allowed && !mission.can.approve.allowed;
  return [needsDispatch ? 'dispatch' : 'approve', rest, 'abort'];
}
