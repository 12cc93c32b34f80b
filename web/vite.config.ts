import { defineConfig } from 'vitest/config';

// Where `npm run dev` finds a gateway or the mock (`npm run mock`).
const backend = process.env['HALCYON_URL'] ?? 'http://127.0.0.1:8080';

export default defineConfig({
  build: {
    target: 'es2022',
    // The page's content security policy is `default-src 'self'`: nothing may be inlined as a data URL.
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
  },
  server: { proxy: { '/api': { target: backend, ws: true }, '/docs': backend, '/openapi.json': backend } },
  test: { environment: 'node', include: ['src/**/*.test.ts', 'mock/**/*.test.mjs'], css: true },
});
