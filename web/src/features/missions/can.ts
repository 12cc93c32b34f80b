/**
 * Which buttons there are, and why one is disabled. The rules themselves are the gateway's (`gateway/src/core/can.rs`, sent
 * along with every mission) and in the end the planner's; here is only what the page adds: without a live link, nothing.
 */
import type { MissionAction } from '../../api/client';
import type { Mission, MissionPhase, Possibility } from '../../api/types';

const yes: Possibility = { allowed: true, why: '' };
const no = (why: string): Possibility => ({ allowed: false, why });

const BEFORE_APPROVAL: readonly MissionPhase[] = ['waiting', 'transit', 'assessing', 'awaiting_approval'];
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

/** What sends the mission on: shown, though disabled, from the start, so that a person knows that it will be asked for. */
function forward(mission: Mission): MissionAction[] {
  const { approve, dispatch, release } = mission.can;
  if (release.allowed) return ['release', 'skip_release'];
  if (approve.allowed) return ['approve'];
  if (dispatch.allowed) return ['dispatch'];
  return mission.approval === 'manual' && BEFORE_APPROVAL.includes(mission.phase) ? ['approve'] : [];
}

/** The buttons worth showing, the likeliest first. Abort is always there until the end. */
export function offered(mission: Mission): MissionAction[] {
  if (isFinal(mission)) return [];
  const rest: MissionAction = mission.phase === 'paused' ? 'resume' : 'pause';
  return [...forward(mission), rest, 'abort'];
}
