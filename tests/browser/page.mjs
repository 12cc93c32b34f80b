/** A page in headless Chromium that keeps what went wrong on it. Needs no download: Debian's Chromium, and the playwright-core
 * that `web/` installed. */
import { createRequire } from 'node:module';

const { chromium } = createRequire(new URL('../../web/package.json', import.meta.url))('playwright-core');

/** The gateway under test, without a slash at the end. */
export const baseUrl = (() => {
  const url = process.env.HALCYON_URL;
  if (!url) throw new Error('set HALCYON_URL to a running gateway, such as http://127.0.0.1:8080');
  return url.replace(/\/+$/, '');
})();

/** No step may take longer; the whole fleet flies meanwhile. */
export const STEP_MS = Number(process.env.HALCYON_STEP_TIMEOUT_S ?? 240) * 1000;

const FLAGS = [
  '--headless', '--no-sandbox', '--disable-gpu', '--disable-quic', '--no-first-run', '--disable-background-networking',
  '--disable-component-update', '--disable-sync',
];

export async function openPage(prepare = async () => {}) {
  const browser = await chromium.launch({ executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium', args: FLAGS });
  const page = await browser.newPage({ viewport: { width: 1440, height: 900 } });
  const errors = [];
  const foreign = [];
  page.on('pageerror', (error) => errors.push(String(error.stack ?? error)));
  page.on('console', (message) => {
    if (message.type() !== 'error') return;
    // A rig that has just begun, or just ended, has no picture to show; the page says so.
    if (/\/preview(\/|$)/.test(new URL(message.location().url || baseUrl).pathname)) return;
    errors.push(`${message.text()} (${message.location().url})`);
  });
  page.on('request', (request) => {
    if (!request.url().startsWith(`${baseUrl}/`)) foreign.push(request.url());
  });
  await prepare(page);
  await page.goto(`${baseUrl}/`, { timeout: STEP_MS });
  return { browser, page, errors, foreign, get: (id) => page.getByTestId(id) };
}
