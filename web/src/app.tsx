/** The page: where each panel goes. */
import { AlarmBar, EventsPanel } from './features/alarms/EventsPanel';
import { PreviewPanel } from './features/camera/PreviewPanel';
import { FleetPanel } from './features/fleet/FleetPanel';
import { MissionPanel, UnderWay } from './features/missions/MissionPanel';
import { TracePanel } from './features/sea/TracePanel';
import { VerdictPanel } from './features/sea/VerdictPanel';
import { ServiceStrip } from './features/services/ServiceStrip';
import { select, selection, type Selection } from './lib/url-state';
import { MapScope } from './scene/MapScope';
import { alarms, live } from './state/store';
import { LinkBar, TopBar } from './ui/TopBar';

const TABS: readonly { id: Selection['tab']; label: string }[] = [
  { id: 'mission', label: 'Mission' },
  { id: 'fleet', label: 'Fleet' },
  { id: 'events', label: 'Events' },
];

export function App({ retry }: { retry: () => void }) {
  return (
    <div class={`app ${live.value ? 'live' : 'not-live'}`}>
      <TopBar />
      <LinkBar retry={retry} />
      <AlarmBar />
      <main class="main" data-tab={selection.value.tab}>
        <div class="left">
          <FleetPanel />
          <EventsPanel />
        </div>
        <div class="middle">
          <MapScope />
          <div class="below">
            <TracePanel />
            <PreviewPanel />
          </div>
        </div>
        <div class="right">
          <VerdictPanel />
          <nav class="tabs" aria-label="Panels">
            {TABS.map(({ id, label }) => (
              <button key={id} aria-pressed={selection.value.tab === id} onClick={() => select({ tab: id })}>
                {label}
                {id === 'events' && alarms.value.length > 0 && <i class="tab-count">{alarms.value.length}</i>}
              </button>
            ))}
          </nav>
          <UnderWay />
          <MissionPanel />
        </div>
      </main>
      <ServiceStrip />
    </div>
  );
}
