/** How long to wait before the `attempt`-th try (from 0): doubling from 0.5 s to 8 s, spread by up to 20 % so that many pages
 * do not knock in step. `spread` is in [0, 1). */
export function backoff_ms(attempt: number, spread: number): number {
  return Math.min(8000, 500 * 2 ** Math.max(0, Math.min(attempt, 10))) * (1 - 0.2 * spread);
}
