/**
 * What the page may say about the water. One rule above all: green only for a verdict that is safe, unexpired by the
 * fleet's own clock, from a rig that still speaks, over a link that is live. Everything else is some kind of "not known".
 */
import type { Heard, Table } from '../../state/reduce';
import type { LinkPhase } from '../../state/link';
import type { Mission, SeaState } from '../../api/types';
import { distance_m } from '../../scene/projection';

export interface Judgement {
  tone: 'safe' | 'unsafe' | 'unknown';
  /** One or two words, for large type. */
  title: string;
  /** A sentence. */
  detail: string;
  /** Seconds of validity left; `null` when nothing is valid. */
  left_s: number | null;
}

/** Judges `heard` at the fleet's time `fleetNow_ms`. */
export function judge(heard: Heard<SeaState> | undefined, phase: LinkPhase, fleetNow_ms: number | null): Judgement {
  const unknown = (title: string, detail: string): Judgement => ({ tone: 'unknown', title, detail, left_s: null });
  if (phase !== 'live') {
    return unknown('Unknown', heard === undefined ? 'Not connected to the gateway.' : 'Not connected: what is shown below is history.');
  }
  if (heard === undefined || fleetNow_ms === null) return unknown('No measurement', 'No sea state has come in yet.');
  const { verdict, stale, rig } = heard.value;
  const left_s = (Date.parse(verdict.valid_until) - fleetNow_ms) / 1000;
  if (verdict.expired || !(left_s > 0)) return unknown('Expired', `The last verdict (${verdict.state}) has run out.`);
  if (stale) return unknown('Stale', `${rig} has gone silent.`);
  switch (verdict.state) {
    case 'safe':
      return { tone: 'safe', title: 'Safe', detail: 'Every check passed.', left_s };
    case 'unsafe':
      return { tone: 'unsafe', title: 'Unsafe', detail: failedChecks(heard.value), left_s };
    case 'inconclusive':
      return { tone: 'unknown', title: 'Inconclusive', detail: failedChecks(heard.value), left_s };
    default:
      return unknown('Unknown', 'This page does not know that verdict; treat it as unsafe.');
  }
}

function failedChecks(sea: SeaState): string {
  const failed = sea.verdict.reasons.filter((reason) => !reason.passed).length;
  return failed === 1 ? 'One check has not passed.' : failed > 1 ? `${failed} checks have not passed.` : 'Not enough is known.';
}

/** The rig to show: the one asked for; else the mission's leader's own; else the one measuring nearest to the mission's point;
 * else the newest. */
export function chooseRig(seas: Table<SeaState>, asked: string | null, mission: Mission | null): string | null {
  const all = Object.values(seas).map((heard) => heard.value);
  if (asked !== null && all.some((sea) => sea.rig === asked)) return asked;
  if (mission !== null) {
    const own = all.find((sea) => sea.rig === mission.leader);
    if (own !== undefined) return own.rig;
    const near = all.toSorted((a, b) => distance_m(a.local, mission.point) - distance_m(b.local, mission.point))[0];
    if (near !== undefined) return near.rig;
  }
  return all.toSorted((a, b) => Date.parse(b.stamp) - Date.parse(a.stamp))[0]?.rig ?? null;
}
