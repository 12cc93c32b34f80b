/** What happened, newest first; what must be acted on stands apart until a person has seen it. */
import { signal } from '@preact/signals';
import type { Event, Severity } from '../../api/types';
import { timeOfDay } from '../../lib/format';
import { acknowledge, alarms, eventKey, events } from '../../state/store';
import { Icon, type IconName } from '../../ui/Icon';
import { Panel } from '../../ui/Panel';

const ICONS: Record<Severity, IconName> = { info: 'info', warning: 'warning', critical: 'cross' };
const SHOWN_MAX = 120;
const onlyTrouble = signal(false);

export function EventsPanel() {
  const shown = events.value.filter((event) => !onlyTrouble.value || event.severity !== 'info').slice(-SHOWN_MAX).toReversed();
  return (
    <Panel
      title="Events"
      class="events"
      testid="events"
      aside={<button class="toggle" aria-pressed={onlyTrouble.value} onClick={() => (onlyTrouble.value = !onlyTrouble.value)}>Warnings only</button>}
    >
      {shown.length === 0 ? (
        <p class="empty">{onlyTrouble.value ? 'No warnings.' : 'Nothing has happened yet.'}</p>
      ) : (
        <ol class="event-list" aria-label="Events, newest first">
          {shown.map((event) => (
            <EventRow key={eventKey(event)} event={event} />
          ))}
        </ol>
      )}
    </Panel>
  );
}

function EventRow({ event }: { event: Event }) {
  return (
    <li class={`event ${event.severity}`}>
      <Icon name={ICONS[event.severity] ?? 'info'} size={17} />
      <div>
        <b><span class="hidden">{event.severity}: </span>{event.what}</b>
        {event.why !== '' && <span>{event.why}</span>}
        <small><time dateTime={event.stamp}>{timeOfDay(Date.parse(event.stamp))}</time> · {event.source}</small>
      </div>
    </li>
  );
}

/** Across the top while a critical event is unseen. */
export function AlarmBar() {
  const newest = alarms.value[0];
  if (newest === undefined) return null;
  const more = alarms.value.length - 1;
  return (
    <div class="alarm" role="alert" data-testid="alarm">
      <Icon name="warning" size={24} />
      <p><b>{newest.what}</b>{newest.why === '' ? '' : ` ${newest.why}`}{more > 0 && <em> and {more} more</em>}</p>
      <button class="button" onClick={acknowledge}>Acknowledge</button>
    </div>
  );
}
