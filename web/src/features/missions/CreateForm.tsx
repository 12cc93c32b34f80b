/** The form for a new mission. The point is typed, or clicked on the map; both show the same place. */
import { signal } from '@preact/signals';
import { useEffect, useId, useState } from 'preact/hooks';
import { ApiError, createMission } from '../../api/client';
import type { Approval, Vehicle } from '../../api/types';
import { select } from '../../lib/url-state';
import { live, vehicles } from '../../state/store';
import { Icon } from '../../ui/Icon';
import { canCreate } from './can';
import { checkForm, readNumber, type FormErrors, type FormText } from './form';
import { draft, selectedMission } from './selection';

const BLANK: FormText = { name: '', north: '', east: '', height: '5', approval: 'manual', leader: '', follower: '' };
/** Survives a look at another mission. */
const form = signal<FormText>(BLANK);

const edit = (change: Partial<FormText>): void => {
  const next = { ...form.peek(), ...change };
  form.value = next;
  if ('north' in change || 'east' in change) {
    const [north_m, east_m] = [readNumber(next.north), readNumber(next.east)];
    draft.value = north_m === null || east_m === null ? null : { north_m, east_m };
  }
};

export function CreateForm() {
  const [errors, setErrors] = useState<FormErrors>({});
  const [failure, setFailure] = useState('');
  const [busy, setBusy] = useState(false);
  const text = form.value;
  const possible = canCreate(live.value);

  // A click on the map fills the two fields in.
  const clicked = draft.value;
  useEffect(() => {
    const now = form.peek();
    if (clicked === null || (readNumber(now.north) === clicked.north_m && readNumber(now.east) === clicked.east_m)) return;
    form.value = { ...now, north: String(clicked.north_m), east: String(clicked.east_m) };
    setErrors({});
  }, [clicked]);

  const submit = async (event: Event): Promise<void> => {
    event.preventDefault();
    const result = checkForm(form.peek());
    setErrors(result.ok ? {} : result.errors);
    setFailure('');
    if (!result.ok || busy || !possible.allowed) return;
    setBusy(true);
    try {
      const answer = await createMission(result.mission);
      form.value = BLANK;
      draft.value = null;
      select({ mission: answer.mission });
    } catch (error) {
      setFailure(error instanceof ApiError ? error.message : 'Something went wrong on this page.');
    } finally {
      setBusy(false);
    }
  };

  return (
    <form class="create" noValidate onSubmit={(event) => void submit(event)} data-testid="create-form">
      <p class="lead"><Icon name="target" />Click on the water, or type metres from the fleet's origin.</p>
      <div class="pair">
        <Field label="North" unit="m" value={text.north} error={errors.north} onInput={(north) => edit({ north })} testid="north" numeric />
        <Field label="East" unit="m" value={text.east} error={errors.east} onInput={(east) => edit({ east })} testid="east" numeric />
      </div>
      <div class="pair">
        <Field label="Name" value={text.name} error={errors.name} onInput={(name) => edit({ name })} testid="name" placeholder="optional" />
        <Field label="Survey height" unit="m" value={text.height} error={errors.height} onInput={(height) => edit({ height })} testid="height" numeric />
      </div>
      <fieldset class="choice">
        <legend>Who approves the landing</legend>
        {(['manual', 'automatic'] as const satisfies readonly Approval[]).map((approval) => (
          <label key={approval} class={text.approval === approval ? 'chosen' : ''}>
            <input type="radio" name="approval" value={approval} checked={text.approval === approval} onChange={() => edit({ approval })} data-testid={`approval-${approval}`} />
            <span><b>{approval === 'manual' ? 'A person' : 'The verdict'}</b><small>{approval === 'manual' ? 'waits for your approval' : 'lands once it is safe'}</small></span>
          </label>
        ))}
      </fieldset>
      <div class="pair">
        <Choice label="Leader" role="leader" value={text.leader} onChange={(leader) => edit({ leader })} />
        <Choice label="Follower" role="follower" value={text.follower} onChange={(follower) => edit({ follower })} />
      </div>
      {failure !== '' && <p class="failure" role="alert">{failure}</p>}
      {!possible.allowed && <p class="why" role="status">{possible.why}</p>}
      <div class="row">
        <button type="submit" class="button primary grow" aria-disabled={!possible.allowed || busy} data-testid="create">{busy ? 'Sending…' : 'Start survey'}</button>
        {selectedMission.value !== null && (
          <button type="button" class="button" onClick={() => { draft.value = null; form.value = BLANK; select({ mission: selectedMission.value?.id ?? null }); }}>Cancel</button>
        )}
      </div>
    </form>
  );
}

interface FieldProps {
  label: string;
  unit?: string;
  value: string;
  error: string | undefined;
  placeholder?: string;
  numeric?: boolean;
  onInput: (text: string) => void;
  testid: string;
}

function Field({ label, unit, value, error, placeholder, numeric = false, onInput, testid }: FieldProps) {
  const id = useId();
  return (
    <div class={`field ${error === undefined ? '' : 'wrong'}`}>
      <label for={id}>{label}</label>
      <div class="input">
        <input
          id={id}
          value={value}
          placeholder={placeholder}
          inputMode={numeric ? 'text' : undefined}
          autocomplete="off"
          aria-invalid={error !== undefined}
          aria-describedby={error === undefined ? undefined : `${id}-error`}
          data-testid={testid}
          onInput={(event) => onInput(event.currentTarget.value)}
        />
        {unit !== undefined && <span class="unit">{unit}</span>}
      </div>
      {error !== undefined && <small id={`${id}-error`} class="error">{error}</small>}
    </div>
  );
}

function Choice({ label, role, value, onChange }: { label: string; role: Vehicle['role']; value: string; onChange: (id: string) => void }) {
  const id = useId();
  const ids = Object.values(vehicles.value).filter((heard) => heard.value.role === role).map((heard) => heard.value.id).sort();
  return (
    <div class="field">
      <label for={id}>{label}</label>
      <select id={id} value={value} onChange={(event) => onChange(event.currentTarget.value)}>
        <option value="">Planner chooses</option>
        {ids.map((one) => <option key={one} value={one}>{one}</option>)}
      </select>
    </div>
  );
}
