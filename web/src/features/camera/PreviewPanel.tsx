/** What the leader's cameras see, once a second while anyone looks. */
import { signal } from '@preact/signals';
import { useEffect } from 'preact/hooks';
import { preview } from '../../api/client';
import type { Preview } from '../../api/types';
import { age } from '../../lib/format';
import { fleetNow_ms, live } from '../../state/store';
import { Icon } from '../../ui/Icon';
import { Panel } from '../../ui/Panel';
import { judgement, rig } from '../sea/selection';

const PERIOD_MS = 1000;

const latest = signal<Preview | null>(null);
const kind = signal<'left' | 'disparity'>('left');

/** Asks again only after the last answer, and never while the page is hidden, the link down, or the rig not measuring. */
function poll(name: string): () => void {
  let timer: ReturnType<typeof setTimeout>;
  let done = false;
  const ask = async (): Promise<void> => {
    if (document.visibilityState === 'visible' && live.peek() && judgement.peek().left_s !== null) {
      const answer = await preview(name).catch(() => null);
      if (done) return;
      if (answer === null ? latest.peek() !== null : answer.stamp !== latest.peek()?.stamp) latest.value = answer;
    }
    if (!done) timer = setTimeout(() => void ask(), PERIOD_MS);
  };
  void ask();
  return () => {
    done = true;
    clearTimeout(timer);
  };
}

export function PreviewPanel() {
  const name = rig.value;
  useEffect(() => {
    latest.value = null;
    return name === null ? undefined : poll(name);
  }, [name]);
  const picture = latest.value;
  const old_s = picture === null || fleetNow_ms.value === null ? null : (fleetNow_ms.value - Date.parse(picture.stamp)) / 1000;
  return (
    <Panel
      title="Camera"
      class="camera"
      testid="camera"
      aside={
        <div class="segments" role="group" aria-label="Picture">
          {(['left', 'disparity'] as const).map((one) => (
            <button key={one} aria-pressed={kind.value === one} onClick={() => (kind.value = one)}>{one === 'left' ? 'Left' : 'Disparity'}</button>
          ))}
        </div>
      }
    >
      <div class={`picture ${live.value ? '' : 'history'}`}>
        {picture === null ? (
          <p class="picture-empty"><Icon name="camera" size={28} />{live.value ? 'No picture yet' : 'Not connected'}</p>
        ) : (
          <>
            <img src={`${picture[kind.value]}?at=${encodeURIComponent(picture.stamp)}`} alt={kind.value === 'left' ? `Rectified left picture of ${name}` : `Disparity of ${name}`} />
            <span class="picture-age">{age(old_s)}</span>
          </>
        )}
      </div>
    </Panel>
  );
}
