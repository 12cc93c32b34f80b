/** The link to the gateway, and what may be believed over it. Pure. */

export type LinkPhase =
  /** First try under way. */
  | 'connecting'
  /** Open, and heard from lately. */
  | 'live'
  /** Open, but nothing comes: the gateway sends a heartbeat every second. */
  | 'silent'
  /** Closed; trying again. */
  | 'lost';

export interface Link {
  open: boolean;
  /** Whether it has ever been open. */
  everOpen: boolean;
  /** When anything was last heard, milliseconds of this machine's clock. */
  heard_ms: number | null;
  /** When the next try begins; `null` while one is under way. */
  retryAt_ms: number | null;
}

export const NO_LINK: Link = { open: false, everOpen: false, heard_ms: null, retryAt_ms: null };

/** Three missed heartbeats. */
export const SILENT_AFTER_MS = 3500;

export function linkPhase(link: Link, now_ms: number): LinkPhase {
  if (!link.open) return link.everOpen || link.retryAt_ms !== null ? 'lost' : 'connecting';
  if (link.heard_ms === null) return 'connecting';
  return now_ms - link.heard_ms > SILENT_AFTER_MS ? 'silent' : 'live';
}
