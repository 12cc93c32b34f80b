/**
 * The live stream: one WebSocket that comes back by itself. Messages are handed over in batches, at most twenty a
 * second, so that a busy fleet costs one render.
 */
import { backoff_ms } from '../lib/backoff';
import { SILENT_AFTER_MS } from '../state/link';
import { parseMessage, type Parsed } from './messages';

export interface StreamEvents {
  opened(): void;
  /** Messages in the order heard, with this machine's time. */
  messages(batch: readonly { message: Parsed; heard_ms: number }[]): void;
  /** Closed; the next try begins at `retryAt_ms`. */
  closed(retryAt_ms: number): void;
  trying(): void;
}

/** How long messages are gathered. */
const FLUSH_MS = 50;

/** More than this unread means that the page was asleep: begin anew instead of replaying. */
const BACKLOG_MAX = 5000;

/** Connects to `url` until the returned function is called; `retry` tries at once. */
export function openStream(url: string, events: StreamEvents): { close: () => void; retry: () => void } {
  let socket: WebSocket | null = null;
  let attempt = 0;
  let timer: ReturnType<typeof setTimeout> | undefined;
  let heard_ms = 0;
  let done = false;
  let pending: { message: Parsed; heard_ms: number }[] = [];
  let flushing = false;

  const flush = (): void => {
    flushing = false;
    const batch = pending;
    pending = [];
    if (batch.length > 0) events.messages(batch);
  };

  const connect = (): void => {
    clearTimeout(timer);
    pending = [];
    events.trying();
    const mine = new WebSocket(url);
    socket = mine;
    heard_ms = Date.now();
    mine.onopen = () => {
      heard_ms = Date.now();
      events.opened();
    };
    mine.onmessage = (event: MessageEvent<unknown>) => {
      heard_ms = Date.now();
      attempt = 0;
      if (pending.length >= BACKLOG_MAX) {
        mine.close();
        return;
      }
      pending.push({ message: parseMessage(String(event.data)), heard_ms });
      if (!flushing) {
        flushing = true;
        // Not an animation frame: a hidden page gets none, and must keep up all the same.
        setTimeout(flush, FLUSH_MS);
      }
    };
    mine.onclose = () => {
      if (done || socket !== mine) return;
      socket = null;
      const wait_ms = backoff_ms(attempt, Math.random());
      attempt += 1;
      timer = setTimeout(connect, wait_ms);
      events.closed(Date.now() + wait_ms);
    };
  };

  // A dead network does not close a socket for minutes; silence does here.
  const watchdog = setInterval(() => {
    if (socket !== null && Date.now() - heard_ms > 3 * SILENT_AFTER_MS) {
      const silent = socket;
      silent.onmessage = null;
      silent.close();
      silent.onclose?.(new CloseEvent('close'));
    }
  }, 1000);

  connect();
  return {
    close: () => {
      done = true;
      clearTimeout(timer);
      clearInterval(watchdog);
      socket?.close();
    },
    retry: () => {
      if (socket === null && !done) {
        attempt = 0;
        connect();
      }
    },
  };
}
