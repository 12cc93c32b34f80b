/** May something land here? The answer in large type, how long it holds, and every reason. */
import type { Estimate, SeaState } from '../../api/types';
import { age, countdown, waveHeight } from '../../lib/format';
import { select } from '../../lib/url-state';
import { fleetNow_ms, seas } from '../../state/store';
import { Icon } from '../../ui/Icon';
import { Panel } from '../../ui/Panel';
import { seaFacts } from './facts';
import { judgement, rig, sea } from './selection';

export function VerdictPanel() {
  const { tone, title, detail, left_s } = judgement.value;
  const state = sea.value?.value;
  const old_s = state === undefined || fleetNow_ms.value === null ? null : (fleetNow_ms.value - Date.parse(state.stamp)) / 1000;
  const rigs = Object.keys(seas.value).sort();
  return (
    <Panel
      title="Water"
      class="verdict-panel"
      testid="verdict-panel"
      aside={
        rigs.length > 1 ? (
          <select class="rig-select" aria-label="Rig" value={rig.value ?? ''} onChange={(event) => select({ rig: event.currentTarget.value })}>
            {rigs.map((one) => <option key={one} value={one}>{one}</option>)}
          </select>
        ) : (
          <span class="count">{state === undefined ? '' : `${state.rig}, ${age(old_s)}`}</span>
        )
      }
    >
      <div class={`verdict ${tone}`} role="status" aria-live="polite" data-testid="verdict" data-tone={tone} data-state={state?.verdict.state ?? 'none'}>
        <span class="verdict-mark"><Icon name={tone === 'safe' ? 'check' : tone === 'unsafe' ? 'cross' : 'question'} size={34} /></span>
        <span class="verdict-words">
          <strong>{title}</strong>
          <span>{detail}</span>
        </span>
        {left_s !== null && (
          <span class="verdict-left" aria-hidden="true" data-testid="verdict-left">
            <small>valid</small>
            {countdown(left_s)}
          </span>
        )}
      </div>
      {state === undefined ? (
        <p class="empty">The verdict appears here once a leader holds over the water and measures.</p>
      ) : (
        <div class={judgement.value.left_s === null ? 'history' : ''}>
          <HeightRow estimate={state.h_s_m} />
          <Facts state={state} />
          <ul class="reasons" aria-label="Checks" data-testid="reasons">
            {state.verdict.reasons.map((reason) => (
              <li key={reason.check} class={reason.passed ? 'passed' : 'failed'}>
                <Icon name={reason.passed ? 'check' : 'cross'} size={18} />
                <span class="hidden">{reason.passed ? 'Passed: ' : 'Not passed: '}</span>
                <span>{reason.text}</span>
              </li>
            ))}
          </ul>
        </div>
      )}
    </Panel>
  );
}

/** What else is known of the waves, in a line each. */
function Facts({ state }: { state: SeaState }) {
  const facts = seaFacts(state, fleetNow_ms.value);
  return facts.length === 0 ? null : (
    <dl class="sea-facts" data-testid="sea-facts">
      {facts.map(({ name, text }) => (
        <div key={name}><dt>{name}</dt><dd>{text}</dd></div>
      ))}
    </dl>
  );
}

/** The significant height and its interval, as numbers and as a bar. */
function HeightRow({ estimate }: { estimate: Estimate | null }) {
  if (estimate === null) return <p class="height-row"><b>H<sub>s</sub> not known</b></p>;
  // Room on the scale beyond the interval, so that its width can be judged.
  const top_m = Math.max(0.05, estimate.high * 1.4);
  const share = (value_m: number): string => `${Math.min(100, Math.max(0, (value_m / top_m) * 100))}%`;
  return (
    <div class="height-row" data-testid="hs">
      <div class="height-words">
        <span title="Significant wave height">Waves H<sub>s</sub></span>
        <b>{waveHeight(estimate.value)}</b>
        <small>95 %: {waveHeight(estimate.low)} – {waveHeight(estimate.high)}</small>
      </div>
      <div class="interval" aria-hidden="true">
        <i style={{ left: share(estimate.low), right: `calc(100% - ${share(estimate.high)})` }} />
        <b style={{ left: share(estimate.value) }} />
      </div>
    </div>
  );
}
