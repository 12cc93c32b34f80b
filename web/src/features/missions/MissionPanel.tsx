/** Missions: one in full, the others one press away, or the form for a new one. */
import type { Mission, MissionPhase } from '../../api/types';
import { age, length, timeOfDay, waveHeight, words } from '../../lib/format';
import { select, selection } from '../../lib/url-state';
import { fleetNow_ms, live } from '../../state/store';
import { Icon } from '../../ui/Icon';
import { Panel } from '../../ui/Panel';
import { Actions } from './Actions';
import { isFinal } from './can';
import { CreateForm } from './CreateForm';
import { begun_ms, PHASE_TEXT, steps } from './progress';
import { allMissions, creating, draft, selectedMission } from './selection';

export function MissionPanel() {
  const mission = creating.value ? null : selectedMission.value;
  return (
    <Panel title={mission === null ? 'New mission' : 'Mission'} class="mission" testid="mission-panel" aside={<Switcher />}>
      {mission === null ? <CreateForm /> : <MissionDetail mission={mission} />}
    </Panel>
  );
}

/** The other missions, and the way to a new one. */
function Switcher() {
  const all = allMissions.value.toSorted((a, b) => begun_ms(b) - begun_ms(a));
  if (all.length === 0) return null;
  const value = creating.value ? 'new' : (selectedMission.value?.id ?? '');
  return (
    <div class="row">
      <select
        class="mission-select"
        aria-label="Show mission"
        value={value}
        onChange={(event) => {
          draft.value = null;
          select({ mission: event.currentTarget.value });
        }}
      >
        {creating.value && <option value="new">New mission</option>}
        {all.map((one) => <option key={one.id} value={one.id}>{isFinal(one) ? `${one.name} (${words(one.phase).toLowerCase()})` : one.name}</option>)}
      </select>
      {!creating.value && (
        <button class="tool small" aria-label="New mission" title="New mission" data-testid="new-mission" onClick={() => select({ mission: 'new' })}>
          <Icon name="plus" />
        </button>
      )}
    </div>
  );
}

const TONES: Partial<Record<MissionPhase, string>> = { completed: 'ok', aborted: 'warn', paused: 'warn', failed: 'bad', awaiting_approval: 'attention' };

function MissionDetail({ mission }: { mission: Mission }) {
  const last = mission.history.at(-1);
  return (
    <div class={live.value ? '' : 'history'} data-testid="mission" data-mission={mission.id} data-phase={mission.phase}>
      <div class={`phase ${TONES[mission.phase] ?? 'active'}`} role="status" aria-live="polite">
        <strong data-testid="phase">{PHASE_TEXT[mission.phase] ?? mission.phase}</strong>
        {last !== undefined && <span>{last.why}</span>}
      </div>
      <ol class="steps" aria-label="Progress">
        {steps(mission).map((step) => (
          <li key={step.label} class={step.state} aria-current={step.state === 'current' || step.state === 'stopped' ? 'step' : undefined}>
            <i aria-hidden="true">{step.state === 'done' ? <Icon name="check" size={14} /> : null}</i>
            {step.label}
          </li>
        ))}
      </ol>
      <Actions mission={mission} />
      <dl class="facts">
        <Fact name="Name" value={mission.name} />
        <Fact name="Point" value={`N ${length(mission.point.north_m)}, E ${length(mission.point.east_m)}`} />
        <Fact name="Survey height" value={length(mission.survey_height_m)} />
        <Fact name="Approval" value={mission.approval === 'automatic' ? 'by the verdict alone' : 'by a person'} />
        <Fact name="Leader" value={mission.leader ?? 'not chosen yet'} />
        <Fact name="Follower" value={mission.follower ?? 'not chosen yet'} />
        {mission.h_s_m !== null && <Fact name="Decided on height" value={`${waveHeight(mission.h_s_m.value)}, at most ${waveHeight(mission.h_s_m.high)}`} />}
        {mission.touchdown !== null && <Fact name="Touchdown" value={mission.touchdown_error_m === null ? 'yes' : `${length(mission.touchdown_error_m)} off the point`} testid="touchdown" />}
      </dl>
      {isFinal(mission) && (
        <button class="button primary wide" onClick={() => select({ mission: 'new' })}>
          <Icon name="plus" />New mission
        </button>
      )}
      <h3>History</h3>
      <ol class="transitions" data-testid="transitions">
        {mission.history.toReversed().map((step, i) => (
          <li key={`${step.stamp} ${mission.history.length - i}`}>
            <time dateTime={step.stamp} title={step.stamp}>{timeOfDay(Date.parse(step.stamp))}</time>
            <div>
              <b>{PHASE_TEXT[step.phase] ?? step.phase}</b>
              <span>{step.why}</span>
              <small>{step.who}{fleetNow_ms.value === null ? '' : ` · ${age((fleetNow_ms.value - Date.parse(step.stamp)) / 1000)} ago`.replace('now ago', 'just now')}</small>
            </div>
          </li>
        ))}
      </ol>
    </div>
  );
}

const Fact = ({ name, value, testid }: { name: string; value: string; testid?: string }) => (
  <div><dt>{name}</dt><dd data-testid={testid}>{value}</dd></div>
);

/** While something else is shown, a mission under way stays one press from its abort button. */
export function UnderWay() {
  const other = allMissions.value.find((one) => !isFinal(one) && (creating.value || one.id !== selectedMission.value?.id));
  if (other === undefined) return null;
  return (
    <button class="under-way" data-testid="under-way" onClick={() => { draft.value = null; select({ mission: other.id, tab: 'mission' }); }}>
      <i class="pulse" aria-hidden="true" />
      <span><b>{other.name}</b> is under way: {(PHASE_TEXT[other.phase] ?? other.phase).toLowerCase()}</span>
      <span class="link">{selection.value.mission === 'new' ? 'Back to it' : 'Show'}</span>
    </button>
  );
}
