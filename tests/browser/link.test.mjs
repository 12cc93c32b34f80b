/** What the page claims when the stream breaks: nothing. And that it comes back by itself. */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { openPage, STEP_MS } from './page.mjs';

test('without a link nothing is believed, and the page reconnects', { timeout: 2 * STEP_MS }, async (t) => {
  let streams = [];
  let broken = false;
  const { browser, page, get } = await openPage((fresh) =>
    fresh.routeWebSocket(/\/api\/v1\/stream$/, (stream) => {
      if (broken) {
        stream.close();
        return;
      }
      stream.connectToServer();
      streams.push(stream);
    }),
  );
  t.after(() => browser.close());
  const link = (phase) => page.locator(`[data-testid=link][data-phase=${phase}]`).waitFor({ timeout: STEP_MS });

  await link('live');
  await page.locator('.vehicle.fresh').first().waitFor({ timeout: STEP_MS });

  broken = true;
  for (const stream of streams) await stream.close();
  streams = [];
  await link('lost');
  await get('link-bar').waitFor({ timeout: STEP_MS });
  await get('map-veil').waitFor({ timeout: STEP_MS });
  assert.equal(await page.locator('.vehicle.fresh').count(), 0, 'no vehicle is shown as present');
  assert.equal(await get('verdict').getAttribute('data-tone'), 'unknown', 'no verdict is shown as valid');
  for (const button of await page.locator('.actions .button, [data-testid=create]').all()) {
    assert.equal(await button.getAttribute('aria-disabled'), 'true', 'no command can be given');
  }

  broken = false;
  await link('live');
  await page.locator('.vehicle.fresh').first().waitFor({ timeout: STEP_MS });
  assert.equal(await get('link-bar').count(), 0);
});
