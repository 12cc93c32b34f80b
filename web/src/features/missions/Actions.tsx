/** What a person can do with a mission now. */
import { useState } from 'preact/hooks';
import { ApiError, commandMission, type MissionAction } from '../../api/client';
import type { Mission } from '../../api/types';
import { live } from '../../state/store';
import { ActionButton, type ActionButtonProps } from '../../ui/ActionButton';
import { judgement } from '../sea/selection';
import { can, offered } from './can';

type Look = Pick<ActionButtonProps, 'label' | 'kind' | 'icon' | 'question' | 'confirmLabel'>;

function look(mission: Mission, action: MissionAction): Look {
  const who = mission.follower ?? 'a follower';
  const water = judgement.value.tone === 'safe' ? 'The water is judged safe.' : 'The newest verdict is not safe: it will wait for one that is.';
  switch (action) {
    case 'approve':
      return {
        label: 'Approve landing', kind: 'primary', icon: 'check', confirmLabel: 'Yes, approve',
        question: mission.dispatch_on_approval ? `Send ${who} to land at ${mission.name}? ${water}` : `Approve the landing at ${mission.name}? ${water}`,
      };
    case 'dispatch':
      return { label: 'Dispatch follower', kind: 'primary', icon: 'check', confirmLabel: 'Yes, dispatch', question: `Send ${who} to land at ${mission.name} now? ${water}` };
    case 'pause':
      return { label: 'Pause', kind: 'plain' };
    case 'resume':
      return { label: 'Resume', kind: 'primary' };
    case 'release':
      return { label: 'Release again', kind: 'primary' };
    case 'skip_release':
      return { label: 'Go on without', kind: 'plain', confirmLabel: 'Yes, complete', question: `Complete ${mission.name} with the payload still held by ${who}? It was not released: ${mission.release_problem ?? 'no reason given'}.` };
    case 'abort':
      return { label: 'Abort', kind: 'danger', icon: 'cross', confirmLabel: 'Yes, abort', question: `Abort ${mission.name}? Every vehicle in the air flies home.` };
  }
}

export function Actions({ mission }: { mission: Mission }) {
  const [failure, setFailure] = useState<{ mission: string; text: string } | null>(null);
  const act = async (action: MissionAction): Promise<void> => {
    setFailure(null);
    try {
      await commandMission(mission.id, action);
    } catch (error) {
      setFailure({ mission: mission.id, text: error instanceof ApiError ? error.message : 'Something went wrong on this page.' });
    }
  };
  const actions = offered(mission);
  if (actions.length === 0) return null;
  return (
    <div class="actions" role="group" aria-label="Mission commands">
      {actions.map((action) => (
        <ActionButton key={`${mission.id} ${action}`} {...look(mission, action)} possible={can(mission, action, live.value)} act={() => act(action)} testid={action} />
      ))}
      {failure !== null && failure.mission === mission.id && <p class="failure" role="alert">{failure.text}</p>}
    </div>
  );
}
