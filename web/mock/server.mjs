/**
 * `npm run mock -- [--port 8080] [--speed 1] [--hs 0.05] [--followers 2] [--empty]`: the page from `dist/` and a scripted
 * fleet behind the gateway's REST and stream contract, with the same content security policy.
 */
import { readFile } from 'node:fs/promises';
import { createServer } from 'node:http';
import { extname, join, normalize } from 'node:path';
import { parseArgs } from 'node:util';
import { WebSocketServer } from 'ws';
import { picture } from './picture.mjs';
import { World } from './world.mjs';

const TYPES = { '.html': 'text/html; charset=utf-8', '.js': 'text/javascript', '.css': 'text/css', '.svg': 'image/svg+xml' };
const DIST = new URL('../dist', import.meta.url).pathname;
const PERIOD_MS = 100;

/** Starts a mock on a free port unless one is given; resolves to its address and what stops it. */
export async function startMock({ port = 0, speed = 1, ...options } = {}) {
  const world = new World({ ...options, speed });
  const server = createServer((request, response) => void answer(world, request, response));
  const sockets = new WebSocketServer({ noServer: true });
  server.on('upgrade', (request, socket, head) => {
    if (request.url !== '/api/v1/stream') return socket.destroy();
    sockets.handleUpgrade(request, socket, head, (client) => snapshot(world).forEach((message) => client.send(JSON.stringify(message))));
  });
  let heard = world.events.length;
  let ticks = 0;
  const timer = setInterval(() => {
    const steps = Math.max(1, Math.round(speed * 2));
    for (let i = 0; i < steps; i += 1) world.step((PERIOD_MS / 1000) * (speed / steps));
    ticks += 1;
    const messages = changes(world, ticks, heard);
    heard = world.events.length;
    for (const client of sockets.clients) for (const message of messages) client.send(JSON.stringify(message));
  }, PERIOD_MS);
  await new Promise((resolve) => server.listen(port, '127.0.0.1', resolve));
  return {
    url: `http://127.0.0.1:${server.address().port}`,
    world,
    stop: () => {
      clearInterval(timer);
      for (const client of sockets.clients) client.terminate();
      server.closeAllConnections();
      return new Promise((resolve) => server.close(resolve));
    },
  };
}

const tagged = (type, all) => all.map((data) => ({ type, data }));

function snapshot(world) {
  return [
    { type: 'hello', data: world.hello() },
    ...tagged('vehicle', world.vehicles.map((one) => world.vehicleJson(one))),
    ...tagged('sea_state', world.lastSea ? [world.lastSea] : []),
    ...tagged('mission', [...world.missions.values()].map((one) => world.missionJson(one))),
    ...tagged('service', world.services()),
    ...tagged('event', world.events.slice(-100)),
  ];
}

function changes(world, ticks, heard) {
  const each = (n) => ticks % n === 0;
  return [
    ...tagged('vehicle', world.vehicles.map((one) => world.vehicleJson(one))),
    ...tagged('event', world.events.slice(heard)),
    ...(each(5) ? tagged('mission', [...world.missions.values()].map((one) => world.missionJson(one))) : []),
    ...(each(10) ? [...tagged('sea_state', world.seas()), ...tagged('service', world.services()), { type: 'plan', data: world.plan() }] : []),
    ...(each(10) ? [{ type: 'heartbeat', data: { now: world.stamp() } }] : []),
  ];
}

async function answer(world, request, response) {
  const { pathname } = new URL(request.url, 'http://mock');
  const json = (status, body) => {
    const type = status >= 400 ? 'application/problem+json' : 'application/json';
    response.writeHead(status, { 'content-type': type }).end(JSON.stringify(body));
  };
  const problem = (status, detail) => json(status, { type: `urn:halcyon:problem:${status}`, title: detail, status, detail, instance: pathname });
  const command = /^\/api\/v1\/missions(?:\/([\w.-]+)\/(\w+))?$/.exec(pathname);
  if (request.method === 'POST' && command) {
    const who = request.headers['halcyon-operator'] ?? 'api';
    let body;
    try {
      body = command[1] ? {} : JSON.parse(await text(request));
    } catch {
      return problem(400, 'the body is not JSON');
    }
    const result = command[1] ? world.command(command[1], command[2], who) : world.create(body, who);
    if (result.status >= 400) return problem(result.status, result.detail);
    const watch = `/api/v1/missions/${result.mission}`;
    return json(202, { stamp: world.stamp(), accepted: true, reason: 'done', mission: result.mission, watch });
  }
  if (request.method === 'GET' && command && !command[1]) {
    return json(200, { items: [...world.missions.values()].map((one) => world.missionJson(one)), next: null });
  }
  const rig = /^\/api\/v1\/rigs\/([\w.-]+)\/preview(?:\/(left|disparity))?/.exec(pathname);
  if (rig) {
    if (!world.lastSea) return problem(404, `no picture from ${rig[1]} yet`);
    if (rig[2]) return response.writeHead(200, { 'content-type': 'image/bmp', 'cache-control': 'no-store' }).end(picture(world.t_s(), rig[2]));
    const base = `/api/v1/rigs/${rig[1]}/preview`;
    return json(200, { rig: rig[1], stamp: world.stamp(), age_s: 0.2, left: `${base}/left`, disparity: `${base}/disparity` });
  }
  if (pathname.startsWith('/api/')) return problem(404, 'no such resource');
  const file = pathname === '/' ? '/index.html' : normalize(pathname);
  try {
    const content = await readFile(join(DIST, file));
    response.writeHead(200, { 'content-type': TYPES[extname(file)] ?? 'application/octet-stream', 'content-security-policy': "default-src 'self'" }).end(content);
  } catch {
    problem(404, 'no such file; run `npm run build` first');
  }
}

async function text(request) {
  let all = '';
  for await (const part of request) {
    all += part;
    if (all.length > 65_536) throw new Error('too long');
  }
  return all;
}

if (process.argv[1] === new URL(import.meta.url).pathname) {
  const { values } = parseArgs({
    options: { port: { type: 'string' }, speed: { type: 'string' }, hs: { type: 'string' }, followers: { type: 'string' }, empty: { type: 'boolean' } },
  });
  const mock = await startMock({
    port: Number(values.port ?? 8080), speed: Number(values.speed ?? 1), h_s_m: Number(values.hs ?? 0.05), followers: Number(values.followers ?? 2),
    empty: values.empty ?? false,
  });
  console.log(`mock fleet at ${mock.url}`);
}
