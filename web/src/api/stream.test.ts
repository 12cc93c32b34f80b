import { afterEach, beforeEach, describe, expect, it, vi } from 'vitest';
import { SILENT_AFTER_MS } from '../state/link';
import { openStream } from './stream';

/** A socket that does what the test says. */
class FakeSocket {
  static all: FakeSocket[] = [];
  onopen: (() => void) | null = null;
  onmessage: ((event: { data: string }) => void) | null = null;
  onclose: (() => void) | null = null;
  closed = false;
  constructor(readonly url: string) {
    FakeSocket.all.push(this);
  }
  close(): void {
    this.closed = true;
  }
}

const newest = (): FakeSocket => FakeSocket.all.at(-1)!;

describe('the live stream', () => {
  const heard: string[] = [];
  let waits: number[] = [];
  let stream: ReturnType<typeof openStream>;

  beforeEach(() => {
    vi.useFakeTimers();
    vi.stubGlobal('WebSocket', FakeSocket);
    vi.stubGlobal('CloseEvent', class {});
    vi.spyOn(Math, 'random').mockReturnValue(0);
    FakeSocket.all = [];
    heard.length = 0;
    waits = [];
    stream = openStream('ws://test/api/v1/stream', {
      trying: () => {},
      opened: () => {},
      closed: (retryAt_ms) => waits.push(retryAt_ms - Date.now()),
      messages: (batch) => heard.push(batch.map((one) => one.message.type).join(' ')),
    });
  });
  afterEach(() => {
    stream.close();
    vi.useRealTimers();
    vi.unstubAllGlobals();
    vi.restoreAllMocks();
  });

  it('hands messages over together and in order, the broken ones too', () => {
    newest().onopen?.();
    for (const data of ['{"type":"heartbeat","data":{"now":"2026-06-01T10:00:00Z"}}', '{"type":"weather","data":{}}', '{oops']) newest().onmessage?.({ data });
    expect(heard).toEqual([]);
    vi.advanceTimersByTime(60);
    expect(heard).toEqual(['heartbeat unknown invalid']);
  });

  it('comes back after longer and longer waits, up to a bound', () => {
    for (let i = 0; i < 7; i += 1) {
      newest().onclose?.();
      vi.advanceTimersByTime(8000);
    }
    expect(waits).toEqual([500, 1000, 2000, 4000, 8000, 8000, 8000]);
    expect(FakeSocket.all).toHaveLength(8);
  });

  it('begins with short waits again once something was heard', () => {
    newest().onclose?.();
    vi.advanceTimersByTime(500);
    newest().onclose?.();
    vi.advanceTimersByTime(1000);
    newest().onmessage?.({ data: '{}' });
    newest().onclose?.();
    expect(waits).toEqual([500, 1000, 500]);
  });

  it('drops a socket that is open but silent', () => {
    newest().onopen?.();
    const silent = newest();
    vi.advanceTimersByTime(3 * SILENT_AFTER_MS + 1500);
    expect(silent.closed).toBe(true);
    expect(waits).toEqual([500]);
  });

  it('tries at once when a person asks, and never after it was closed', () => {
    newest().onclose?.();
    stream.retry();
    expect(FakeSocket.all).toHaveLength(2);
    stream.close();
    newest().onclose?.();
    vi.advanceTimersByTime(60_000);
    expect(FakeSocket.all).toHaveLength(2);
  });
});
