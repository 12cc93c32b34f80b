/**
 * A button that may be impossible, and then says why; that may need a second press, and then asks. The question stands in
 * the page, so that the fleet stays in sight and alarms keep coming while it waits.
 */
import { useEffect, useId, useRef, useState } from 'preact/hooks';
import type { Possibility } from '../api/types';
import { Icon, type IconName } from './Icon';

export interface ActionButtonProps {
  label: string;
  icon?: IconName;
  kind?: 'primary' | 'danger' | 'plain';
  possible: Possibility;
  /** Asked before acting; without it the button acts at once. */
  question?: string;
  /** The words on the button that confirms. */
  confirmLabel?: string;
  act: () => Promise<void>;
  testid: string;
}

/** A question that nobody answers goes away. */
const ASK_MS = 20_000;

export function ActionButton({ label, icon, kind = 'plain', possible, question, confirmLabel, act, testid }: ActionButtonProps) {
  const [asking, setAsking] = useState(false);
  const [busy, setBusy] = useState(false);
  const whyId = useId();
  const confirm = useRef<HTMLButtonElement>(null);
  const opener = useRef<HTMLButtonElement>(null);

  useEffect(() => {
    if (!asking) return;
    confirm.current?.focus();
    const timer = setTimeout(() => setAsking(false), ASK_MS);
    return () => clearTimeout(timer);
  }, [asking]);

  const run = async (): Promise<void> => {
    if (busy || !possible.allowed) return;
    setBusy(true);
    try {
      await act();
    } finally {
      setBusy(false);
      setAsking(false);
    }
  };
  const cancel = (): void => {
    setAsking(false);
    requestAnimationFrame(() => opener.current?.focus());
  };

  if (asking && question !== undefined) {
    return (
      <div class={`ask ask-${kind}`} role="group" aria-label={question} data-testid={`${testid}-ask`} onKeyDown={(event) => event.key === 'Escape' && cancel()}>
        <p>{question}</p>
        {!possible.allowed && <p class="why" role="status">{possible.why}</p>}
        <div class="row">
          <button
            ref={confirm}
            class={`button ${kind}`}
            disabled={!possible.allowed || busy}
            data-testid={`${testid}-confirm`}
            onClick={() => void run()}
            // A key held down since the first press must not answer the question.
            onKeyDown={(event) => event.repeat && event.preventDefault()}
          >
            {busy ? 'Sending…' : (confirmLabel ?? label)}
          </button>
          <button class="button" onClick={cancel} data-testid={`${testid}-cancel`}>Cancel</button>
        </div>
      </div>
    );
  }
  return (
    <div class="action">
      <button
        ref={opener}
        class={`button ${kind}`}
        // Not `disabled`: it stays reachable, so that a keyboard or a screen reader can learn why.
        aria-disabled={!possible.allowed || busy}
        aria-describedby={possible.allowed ? undefined : whyId}
        title={possible.allowed ? undefined : possible.why}
        data-testid={testid}
        onClick={() => {
          if (!possible.allowed || busy) return;
          if (question === undefined) void run();
          else setAsking(true);
        }}
      >
        {icon !== undefined && <Icon name={icon} />}
        {busy ? 'Sending…' : label}
      </button>
      {!possible.allowed && <span id={whyId} class="why">{possible.why}</span>}
    </div>
  );
}
