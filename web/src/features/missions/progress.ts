/** Where a mission is on its way, for the row of steps. Pure. */
import type { Mission, MissionPhase } from '../../api/types';

export interface Step {
  label: string;
  state: 'done' | 'current' | 'ahead' | 'stopped';
}

const STEPS: readonly { label: string; phases: readonly MissionPhase[] }[] = [
  { label: 'Fly out', phases: ['waiting', 'transit'] },
  { label: 'Assess', phases: ['assessing'] },
  { label: 'Approve', phases: ['awaiting_approval', 'approved'] },
  { label: 'Join', phases: ['joining'] },
  { label: 'Clear', phases: ['clearing'] },
  { label: 'Land', phases: ['landing', 'releasing'] },
];

/** What each phase means, for people. */
export const PHASE_TEXT: Record<MissionPhase, string> = {
  waiting: 'Waiting for a leader',
  transit: 'Leader on its way',
  assessing: 'Measuring the water',
  awaiting_approval: 'Waiting for approval',
  approved: 'Approved',
  joining: 'Follower joins the leader',
  clearing: 'Leader clears the spot',
  landing: 'Follower is landing',
  releasing: 'Payload is let go',
  paused: 'Paused: all hold',
  completed: 'Follower has landed',
  aborted: 'Aborted: all return',
  failed: 'Failed',
};

/** The phase in which the mission was before it was paused or ended. */
export function lastActivePhase(mission: Mission): MissionPhase {
  const stopped: readonly MissionPhase[] = ['paused', 'completed', 'aborted', 'failed'];
  if (!stopped.includes(mission.phase)) return mission.phase;
  return mission.history.findLast((step) => !stopped.includes(step.phase))?.phase ?? 'waiting';
}

/** The steps; exactly one is current or stopped, unless all are done. */
export function steps(mission: Mission): Step[] {
  if (mission.phase === 'completed') return STEPS.map(({ label }) => ({ label, state: 'done' }));
  const at = STEPS.findIndex(({ phases }) => phases.includes(lastActivePhase(mission)));
  const halted = mission.phase === 'aborted' || mission.phase === 'failed' || mission.phase === 'paused';
  return STEPS.map(({ label }, i) => ({ label, state: i < at ? 'done' : i > at ? 'ahead' : halted ? 'stopped' : 'current' }));
}

/** The mission to show: the one asked for, else the newest that is still under way, else the newest. */
export function chooseMission(missions: readonly Mission[], asked: string | null): Mission | null {
  const newestFirst = missions.toSorted((a, b) => begun_ms(b) - begun_ms(a));
  return (
    newestFirst.find((mission) => mission.id === asked) ??
    newestFirst.find((mission) => !['completed', 'aborted', 'failed'].includes(mission.phase)) ??
    newestFirst[0] ??
    null
  );
}

/** When it was created. */
export const begun_ms = (mission: Mission): number => Date.parse(mission.history[0]?.stamp ?? mission.stamp);
