import { expect, it } from 'vitest';
import { operatorHeader } from './operator';

// The gateway's own pattern for the header.
const ALLOWED = /^[!-~]([ -~]{0,62}[!-~])?$/;

it.each([
  ['', 'dashboard'],
  ['  ', 'dashboard'],
  [' Ada  Lovelace ', 'Ada  Lovelace'],
  ['Zoë Åström', 'Zoe Astrom'],
  ['王', 'dashboard'],
  ['a\r\nX-Evil: 1', 'aX-Evil: 1'],
  [`${'x'.repeat(63)} y`, 'x'.repeat(63)],
])('%j is recorded as %j', (name, header) => {
  expect(operatorHeader(name)).toBe(header);
  expect(operatorHeader(name)).toMatch(ALLOWED);
});
