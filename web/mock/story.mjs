/** `npm run test:page`: the browser stories against the mock, for work on the page alone. */
import { spawn } from 'node:child_process';
import { startMock } from './server.mjs';

const mock = await startMock({ speed: 8 });
const folder = new URL('../../tests/browser/', import.meta.url).pathname;
const files = ['link.test.mjs', 'mission.test.mjs'].map((name) => folder + name);
const child = spawn(process.execPath, ['--test', '--test-concurrency=1', ...files], {
  stdio: 'inherit',
  env: { ...process.env, HALCYON_URL: mock.url, HALCYON_STEP_TIMEOUT_S: '60' },
});
child.on('exit', async (code) => {
  await mock.stop();
  process.exitCode = code ?? 1;
});
