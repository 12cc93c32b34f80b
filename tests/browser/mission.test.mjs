/**
 * A person at the dashboard: creates a mission, sees the verdict, approves, and watches the follower land.
 *
 *     HALCYON_URL=http://127.0.0.1:8080 [HALCYON_SCREENSHOT=page.png] node --test tests/browser/mission.test.mjs
 */
import assert from 'node:assert/strict';
import { test } from 'node:test';
import { baseUrl, openPage, STEP_MS } from './page.mjs';

const FINAL = ['completed', 'aborted', 'failed'];

test('a mission from the form to the landing', { timeout: 4 * STEP_MS }, async (t) => {
  const { browser, page, errors, foreign, get } = await openPage();
  t.after(() => browser.close());
  const mission = page.locator('[data-testid=mission]');
  /** Waits until the mission's phase is one of these, or one from which it cannot come back. */
  const reaches = async (...phases) => {
    await page.waitForFunction(
      (wanted) => wanted.includes(document.querySelector('[data-testid=mission]')?.dataset.phase),
      [...phases, ...FINAL],
      { timeout: STEP_MS },
    );
    const phase = await mission.getAttribute('data-phase');
    const told = (await get('transitions').innerText()).replaceAll('\n', ' | ');
    assert.ok(phases.includes(phase), `expected ${phases.join(' or ')}, but the mission is ${phase}: ${told}`);
  };

  await page.locator('[data-testid=link][data-phase=live]').waitFor({ timeout: STEP_MS });
  await page.locator('.vehicle.leader').first().waitFor({ timeout: STEP_MS });
  await page.locator('.vehicle.follower').first().waitFor({ timeout: STEP_MS });

  await get('operator').fill('Story tester');

  // What is wrong in the form is said at its field, and nothing is sent.
  if (!(await get('create-form').isVisible())) await get('new-mission').click();
  await get('north').fill('far away');
  await get('create').click();
  assert.equal(await get('north').getAttribute('aria-invalid'), 'true');
  assert.equal(await mission.count(), 0);

  await get('name').fill('Story bay');
  await get('north').fill('24');
  await get('east').fill('10');
  await get('height').fill('5');
  await get('approval-manual').check();
  await get('create').click();
  await mission.waitFor({ timeout: STEP_MS });
  const id = await mission.getAttribute('data-mission');
  assert.equal(new URL(page.url()).searchParams.get('mission'), id, 'the mission is in the address');

  // Before there is a verdict the button is there, disabled, and says why.
  const approve = get('approve');
  if ((await mission.getAttribute('data-phase')) !== 'awaiting_approval') {
    assert.equal(await approve.getAttribute('aria-disabled'), 'true');
    const why = await approve.getAttribute('aria-describedby');
    assert.notEqual((await page.locator(`[id="${why}"]`).innerText()).trim(), '');
  }

  await reaches('awaiting_approval');
  await page.locator('[data-testid=verdict][data-tone=safe]').waitFor({ timeout: STEP_MS });
  assert.ok((await get('reasons').locator('li').count()) > 0, 'the verdict gives its reasons');
  assert.match(await get('hs').innerText(), /\d+\.\d.cm/u);

  // A verdict may run out and come back while a person makes up their mind; then they try again.
  const deadline = Date.now() + STEP_MS;
  while (['assessing', 'awaiting_approval'].includes(await mission.getAttribute('data-phase'))) {
    assert.ok(Date.now() < deadline, 'the approval was not accepted in time');
    await reaches('awaiting_approval', 'approved', 'joining', 'clearing', 'landing', 'completed');
    try {
      await approve.click({ timeout: 2000 });
      await get('approve-confirm').click({ timeout: 2000 });
      await reaches('approved', 'joining', 'clearing', 'landing', 'completed');
    } catch (error) {
      if (error instanceof assert.AssertionError) throw error;
    }
  }

  await reaches('completed');
  assert.match(await get('touchdown').innerText(), /\d/);
  const answer = await page.request.get(`${baseUrl}/api/v1/missions`);
  const listed = (await answer.json()).items.find((one) => one.id === id);
  assert.equal(listed?.phase, 'completed', 'the page and the API agree');
  await page.locator(`[data-testid="vehicle-${listed.follower}"][data-activity=landed]`).waitFor({ timeout: STEP_MS });
  for (const word of ['Waiting for approval', 'Story tester', 'Follower is landing', 'Follower has landed']) {
    assert.ok((await get('transitions').innerText()).includes(word), `the history tells of "${word}"`);
  }

  const unnamed = await page.locator('button:visible').evaluateAll((all) => all.filter((one) => !(one.ariaLabel ?? one.textContent).trim()).length);
  assert.equal(unnamed, 0, 'every button has a name');
  if (process.env.HALCYON_SCREENSHOT) await page.screenshot({ path: process.env.HALCYON_SCREENSHOT });
  assert.deepEqual(errors, [], 'the console is clean');
  assert.deepEqual(foreign, [], 'nothing was asked of another host');
});
