import openapiTS, { astToString } from 'openapi-typescript';
import { expect, it } from 'vitest';
import openapi from './openapi.json';
import held from './schema.gen.ts?raw';

it('the generated types are those of the contract: else run `npm run generate`', async () => {
  const current = astToString(await openapiTS(openapi as unknown as Parameters<typeof openapiTS>[0]));
  expect(held.slice(held.indexOf('export interface paths')).trim()).toBe(current.trim());
});
