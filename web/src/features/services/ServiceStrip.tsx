/** The health of every service in one line, with the details behind a press. */
import { computed } from '@preact/signals';
import { age, fixed } from '../../lib/format';
import { fleet, live, services } from '../../state/store';
import { Icon } from '../../ui/Icon';
import { groupServices, serviceTone } from './summary';

const groups = computed(() => groupServices(Object.values(services.value).map((heard) => heard.value), live.value));

export function ServiceStrip() {
  const all = groups.value.flatMap((group) => group.instances);
  const well = all.filter((one) => serviceTone(one, live.value) === 'ok').length;
  const { refused } = fleet.value;
  return (
    <footer class="strip" data-testid="services">
      <details>
        <summary>
          <span class={`strip-sum ${all.length > 0 && well === all.length ? 'ok' : live.value ? 'warn' : 'idle'}`}>
            <i class="dot" aria-hidden="true" />
            {!live.value ? 'Services unknown' : all.length === 0 ? 'No services yet' : `${well} of ${all.length} services ready`}
          </span>
          <span class="strip-groups">
            {groups.value.map((group) => (
              <span key={group.service} class={`chip ${group.tone}`}>
                <i class="dot" aria-hidden="true" />{group.service}{group.instances.length > 1 && <small>×{group.instances.length}</small>}
              </span>
            ))}
          </span>
          <Icon name="chevron" />
        </summary>
        <div class="strip-table">
          <table>
            <thead><tr><th>Service</th><th>State</th><th>Says</th><th>Up</th><th>Restarts</th><th>Version</th></tr></thead>
            <tbody>
              {groups.value.flatMap((group) => group.instances).map((one) => (
                <tr key={one.instance} class={serviceTone(one, live.value)}>
                  <td><i class="dot" aria-hidden="true" />{one.instance}</td>
                  <td>{!live.value ? 'unknown' : one.stale ? 'silent' : one.state}</td>
                  <td>{one.detail}</td>
                  <td>{age(one.uptime_s)}</td>
                  <td>{fixed(one.restarts, 0)}</td>
                  <td>{one.version}</td>
                </tr>
              ))}
            </tbody>
          </table>
          {refused.invalid + refused.unknown + refused.late > 0 && (
            <p class="refused">Stream messages not used: {refused.invalid} malformed, {refused.unknown} of unknown type, {refused.late} late. Last: {refused.last}.</p>
          )}
        </div>
      </details>
    </footer>
  );
}
