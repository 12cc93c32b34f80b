/** Whose page this is, whether it is in touch, and what time it is for the fleet. */
import { age, countdown, timeOfDay } from '../lib/format';
import { operator } from '../lib/operator';
import { nextTheme, themeChoice } from '../lib/theme';
import { rate } from '../state/fleet-clock';
import type { LinkPhase } from '../state/link';
import { fleet, fleetNow_ms, hello, link, now_ms, phase } from '../state/store';
import { Icon } from './Icon';

const LINK_TEXT: Record<LinkPhase, string> = { connecting: 'Connecting', live: 'Live', silent: 'Silent', lost: 'Disconnected' };

export function TopBar() {
  const speed = rate(fleet.value.clock);
  return (
    <header class="top">
      <a class="brand" href="/" aria-label="Halcyon, start page">
        <svg viewBox="0 0 32 32" width="32" height="32" aria-hidden="true">
          <path class="brand-wave" d="M3 21c4.3 0 4.3-3 8.7-3s4.300 3 8.600 3 4.400-3 8.700-3" />
          <path class="brand-wave faint" d="M3 27c4.300 0 4.300-3 8.700-3s4.300 3 8.600 3 4.400-3 8.700-3" />
          <path class="brand-bird" d="M16 3l6 10.500-6-2.700-6 2.700z" />
        </svg>
        <h1>Halcyon</h1>
      </a>
      <span class="fleet-name">{hello.value === null ? '' : hello.value.fleet}</span>
      <span class="grow" />
      {speed > 1.2 && phase.value === 'live' && <span class="speed" title="Simulated time runs faster than the wall clock">× {speed.toFixed(speed < 9.5 ? 1 : 0)}</span>}
      <label class="operator" title="Who commands, for the record">
        <Icon name="person" size={17} />
        <span class="hidden">Your name, for the record</span>
        <input value={operator.value} placeholder="Your name" maxLength={64} autocomplete="nickname" onInput={(event) => (operator.value = event.currentTarget.value)} data-testid="operator" />
      </label>
      <span class="clock" title="The fleet's clock"><Icon name="clock" size={16} />{phase.value === 'live' ? timeOfDay(fleetNow_ms.value) : '–'}</span>
      <span class={`link-state ${phase.value}`} role="status" data-testid="link" data-phase={phase.value}>
        <i class="dot" aria-hidden="true" />{LINK_TEXT[phase.value]}
      </span>
      <button class="tool" onClick={nextTheme} aria-label={`Colours: ${themeChoice.value}. Change`} title={`Colours: ${themeChoice.value}`}>
        <Icon name={themeChoice.value === 'light' ? 'sun' : themeChoice.value === 'dark' ? 'moon' : 'auto'} />
      </button>
    </header>
  );
}

/** Across the page while the link is down: what is shown is history, and when the next try is. */
export function LinkBar({ retry }: { retry: () => void }) {
  if (phase.value === 'live' || (phase.value === 'connecting' && !link.value.everOpen)) return null;
  const { heard_ms, retryAt_ms } = link.value;
  const since = heard_ms === null ? '' : ` Last heard ${age((now_ms.value - heard_ms) / 1000)} ago.`.replace('now ago', 'just now');
  const next = retryAt_ms === null ? 'Trying…' : `Next try in ${countdown((retryAt_ms - now_ms.value) / 1000)}.`;
  return (
    <div class="link-bar" role="alert" data-testid="link-bar">
      <Icon name="warning" size={22} />
      <p><b>{phase.value === 'silent' ? 'The gateway is silent.' : 'Not connected to the gateway.'}</b> Everything below is history; the fleet keeps flying its plan.{since} {phase.value === 'lost' && next}</p>
      {phase.value === 'lost' && <button class="button" onClick={retry}>Try now</button>}
    </div>
  );
}
