/**
 * A scripted fleet that speaks the gateway's contract, to develop and test the page against. It is no simulation: vehicles
 * glide to where the script sends them and the sea is two sines. What flies for real is `halcyon up`.
 */
import { can, FINAL } from './rules.mjs';

const ORIGIN = { latitude_deg: 60.1867, longitude_deg: 24.8277, altitude_m: 0 };
const M_PER_DEG_NORTH = 111_415;
const M_PER_DEG_EAST = 55_575;
const SPEED_MPS = 4;
const CLIMB_MPS = 1.2;
const SLOT = { forward_m: 0, right_m: 7, up_m: 0 };
const VALID_S = 10;

export const point = ({ north_m, east_m }) => ({
  latitude_deg: ORIGIN.latitude_deg + north_m / M_PER_DEG_NORTH,
  longitude_deg: ORIGIN.longitude_deg + east_m / M_PER_DEG_EAST,
  north_m,
  east_m,
});
const fromGlobal = ({ latitude_deg, longitude_deg }) => ({
  north_m: (latitude_deg - ORIGIN.latitude_deg) * M_PER_DEG_NORTH,
  east_m: (longitude_deg - ORIGIN.longitude_deg) * M_PER_DEG_EAST,
});
const distance = (a, b) => Math.hypot(a.north_m - b.north_m, a.east_m - b.east_m);
const ahead = (from, heading_deg, forward_m, right_m) => {
  const [sin, cos] = [Math.sin((heading_deg * Math.PI) / 180), Math.cos((heading_deg * Math.PI) / 180)];
  return { north_m: from.north_m + forward_m * cos - right_m * sin, east_m: from.east_m + forward_m * sin + right_m * cos };
};

export class World {
  constructor({ followers = 2, h_s_m = 0.05, start_ms = Date.now(), empty = false, speed = 1 } = {}) {
    this.speed = speed;
    this.h_s_m = h_s_m;
    this.now_ms = start_ms;
    this.begun_ms = start_ms;
    this.missions = new Map();
    this.events = [];
    this.generation = 0;
    this.lastSea = null;
    this.vehicles = empty
      ? []
      : ['leader-1', ...Array.from({ length: followers }, (_, i) => `follower-${i + 1}`)].map((id, i) => ({
          id, role: i === 0 ? 'leader' : 'follower', at: { north_m: 0, east_m: -8 * i }, home: { north_m: 0, east_m: -8 * i }, height_m: 0,
          velocity: { north_mps: 0, east_mps: 0 }, heading_deg: 90, goal: null, height_goal_m: 0, battery: 98 - 3 * i, kind: 'idle', touchdown: null,
        }));
    this.event('info', 'mission-planner', 'Planner started', 'nothing to resume');
  }

  t_s() {
    return (this.now_ms - this.begun_ms) / 1000;
  }
  stamp(offset_s = 0) {
    return new Date(this.now_ms + offset_s * 1000).toISOString();
  }
  vehicle(id) {
    return this.vehicles.find((one) => one.id === id);
  }
  event(severity, source, what, why, more = {}) {
    this.events.push({ sequence: this.events.length, stamp: this.stamp(), source, severity, what, why, vehicle: null, mission: null, ...more });
  }
  elevation_m(t_s) {
    return (this.h_s_m / 3.4) * (Math.sin(4.8 * t_s) + 0.7 * Math.sin(3.9 * t_s + 1) + 0.2 * Math.sin(11 * t_s));
  }

  /** One step of the script. */
  step(dt_s) {
    this.now_ms += dt_s * 1000;
    for (const vehicle of this.vehicles) this.fly(vehicle, dt_s);
    for (const mission of this.missions.values()) if (!FINAL.includes(mission.phase)) this.advance(mission);
  }

  fly(vehicle, dt_s) {
    const goal = vehicle.goal?.() ?? vehicle.at;
    const [dn, de] = [goal.north_m - vehicle.at.north_m, goal.east_m - vehicle.at.east_m];
    const away = Math.hypot(dn, de);
    const flying = vehicle.height_m > 2;
    const move = flying ? Math.min(away, Math.min(SPEED_MPS, 0.2 + away * 0.6) * dt_s) : 0;
    if (away > 1e-6) {
      vehicle.at = { north_m: vehicle.at.north_m + (dn / away) * move, east_m: vehicle.at.east_m + (de / away) * move };
      if (flying && away > 3) vehicle.heading_deg = ((Math.atan2(de, dn) * 180) / Math.PI + 360) % 360;
    }
    vehicle.velocity = away > 1e-6 ? { north_mps: (dn / away) * (move / dt_s), east_mps: (de / away) * (move / dt_s) } : { north_mps: 0, east_mps: 0 };
    vehicle.away_m = away;
    const target_m = vehicle.kind === 'returning' && away < 0.5 ? 0 : vehicle.height_goal_m;
    vehicle.height_m += Math.sign(target_m - vehicle.height_m) * Math.min(Math.abs(target_m - vehicle.height_m), CLIMB_MPS * dt_s);
    vehicle.there = away < 0.6 && Math.abs(vehicle.height_m - vehicle.height_goal_m) < 0.1;
    if (vehicle.kind === 'returning' && vehicle.height_m === 0) Object.assign(vehicle, { kind: 'idle', goal: null, height_goal_m: 0 });
    if (vehicle.height_m > 0) vehicle.battery = Math.max(5, vehicle.battery - 0.02 * dt_s);
  }

  send(vehicle, kind, goal, height_goal_m) {
    Object.assign(vehicle, { kind, goal, height_goal_m, there: false });
    this.generation += 1;
  }
  home(vehicle) {
    if (vehicle && vehicle.height_m > 0) this.send(vehicle, 'returning', () => vehicle.home, 5);
  }

  to(mission, phase, why, who = 'planner') {
    mission.phase = phase;
    mission.since_s = this.t_s();
    mission.stamp = this.stamp();
    mission.history.push({ stamp: this.stamp(), phase, who, why });
    const severity = phase === 'failed' ? 'critical' : phase === 'aborted' ? 'warning' : 'info';
    this.event(severity, 'mission-planner', `${mission.name}: ${phase.replaceAll('_', ' ')}`, why, { mission: mission.id });
  }

  advance(mission) {
    const leader = this.vehicle(mission.leader);
    const follower = this.vehicle(mission.follower);
    const verdict = this.sea(mission)?.verdict.state ?? null;
    mission.verdict = verdict;
    const waited_s = this.t_s() - mission.since_s;
    switch (mission.phase) {
      case 'waiting': {
        const free = this.vehicles.find((one) => one.role === 'leader' && one.kind === 'idle');
        if (!free || waited_s < 1) return;
        mission.leader = free.id;
        this.send(free, 'transit', () => mission.point, mission.survey_height_m);
        return this.to(mission, 'transit', `${free.id} is ready and nearest`);
      }
      case 'transit':
        if (!leader.there) return;
        leader.kind = 'holding';
        return this.to(mission, 'assessing', `${leader.id} holds over the point`);
      case 'assessing':
        if (waited_s > 20 && verdict === 'safe') {
          mission.h_s_m = this.estimate(this.h_s_m);
          return this.to(mission, mission.approval === 'automatic' ? 'approved' : 'awaiting_approval', 'the verdict is safe');
        }
        if (waited_s > 40 && verdict === 'unsafe') {
          this.home(leader);
          return this.to(mission, 'failed', 'the water is not safe: significant height over its limit');
        }
        return;
      case 'approved': {
        const free = this.vehicles.find((one) => one.role === 'follower' && one.kind === 'idle');
        if (!free) return;
        mission.follower = free.id;
        this.send(free, 'following', () => ahead(leader.at, leader.heading_deg, SLOT.forward_m, SLOT.right_m), 5);
        return this.to(mission, 'joining', `${free.id} is ready, battery ${free.battery.toFixed(0)} %`);
      }
      case 'joining':
        if (!follower.there) return;
        mission.clear = ahead(leader.at, leader.heading_deg, 10, 0);
        this.send(leader, 'holding', () => mission.clear, mission.survey_height_m);
        return this.to(mission, 'clearing', 'follower settled in its slot');
      case 'clearing':
        if (!leader.there || !follower.there) return;
        this.send(follower, 'approaching', () => mission.point, 5);
        return this.to(mission, 'landing', 'the spot is clear');
      case 'landing':
        if (follower.kind === 'approaching' && follower.there) this.send(follower, 'descending', () => mission.point, 0);
        if (follower.kind !== 'descending' || follower.height_m > 0) return;
        follower.kind = 'landed';
        follower.touchdown = { north_m: follower.at.north_m + 0.21, east_m: follower.at.east_m - 0.13 };
        mission.touchdown = follower.touchdown;
        this.home(leader);
        return this.to(mission, 'completed', 'touched down 0.2 m from the point');
      default:
    }
  }

  /** Answers like the gateway: `{ status, body }`. */
  create(body, who = 'dashboard') {
    const given = body?.point ?? {};
    const local = 'latitude_deg' in given ? fromGlobal(given) : given;
    if (!Number.isFinite(local.north_m) || !Number.isFinite(local.east_m)) return { status: 400, detail: 'a point has latitude_deg and longitude_deg, or north_m and east_m' };
    const id = body.id ?? `mission-${this.missions.size + 1}`;
    const mission = {
      id, name: body.name ?? id, point: local, survey_height_m: body.survey_height_m ?? 5, approval: body.approval ?? 'manual', phase: 'waiting',
      dispatch_on_approval: body.dispatch_on_approval ?? true, leader: body.leader ?? null, follower: body.follower ?? null, verdict: null, h_s_m: null,
      touchdown: null, history: [],
    };
    this.missions.set(id, mission);
    this.to(mission, 'waiting', 'created', who);
    return { status: 202, mission: id };
  }

  command(id, action, who = 'dashboard') {
    const mission = this.missions.get(id);
    if (!mission) return { status: 404, detail: `no mission ${id}` };
    const possible = can(mission)[action];
    if (!possible) return { status: 404, detail: `no action ${action}` };
    if (!possible.allowed) return { status: 409, detail: possible.why };
    if (action === 'approve' || action === 'dispatch') this.to(mission, 'approved', 'approved by a person', who);
    if (action === 'pause') {
      mission.resumeTo = mission.phase;
      this.to(mission, 'paused', 'paused by a person', who);
    }
    if (action === 'resume') this.to(mission, mission.resumeTo, 'resumed by a person', who);
    if (action === 'abort') {
      this.home(this.vehicle(mission.leader));
      this.home(this.vehicle(mission.follower));
      this.to(mission, 'aborted', 'aborted by a person', who);
    }
    return { status: 202, mission: id };
  }

  estimate(value) {
    return { value, low: value * 0.9, high: value * 1.12 };
  }

  sea(mission) {
    const leader = this.vehicle(mission.leader);
    if (!leader || leader.kind !== 'holding') return null;
    const since_s = Math.min(60, this.t_s() - mission.since_s + (mission.phase === 'assessing' ? 0 : 60));
    if (since_s < 3) return null;
    const [h, limit] = [this.estimate(this.h_s_m * (1 + 0.03 * Math.sin(this.t_s() / 5))), 0.15];
    const waves = Math.floor(since_s * 0.75 * 5);
    const cm = (value_m) => `${(value_m * 100).toFixed(1)} cm`;
    const reasons = [
      { check: 'significant_height', passed: h.high < limit, text: `H_s upper bound ${cm(h.high)}, limit ${cm(limit)}` },
      { check: 'waves', passed: waves >= 50, text: `${waves} waves, at least 50` },
      { check: 'window', passed: since_s >= 15, text: `${since_s.toFixed(0)} s observed, at least 15 s` },
      { check: 'slope', passed: true, text: 'slope upper bound 2.1°, limit 8.0°' },
      { check: 'coverage', passed: true, text: 'coverage 91 %, at least 60 %' },
    ].toSorted((a, b) => Number(a.passed) - Number(b.passed));
    const state = reasons[0].passed ? 'safe' : h.low > limit ? 'unsafe' : 'inconclusive';
    const window_s = Math.min(60, since_s);
    return {
      rig: leader.id, stamp: this.stamp(), age_s: 0, stale: false, window_start: this.stamp(-window_s), window_s, local: point(leader.at),
      patches: Math.floor(window_s * 5), coverage: 0.91, waves, h_mean_m: this.estimate(h.value * 0.63), h_s_m: h, h_max_m: this.estimate(h.value * 1.6),
      h_m0_m: this.estimate(h.value * 1.04), t_z_s: this.estimate(1.32), slope_rms_rad: this.estimate(0.033),
      h_rms_m: this.estimate(h.value * 0.7), h_tenth_m: this.estimate(h.value * 1.26), t_p_s: this.estimate(1.41), t_m01_s: this.estimate(1.36),
      t_m02_s: this.estimate(1.3), t_e_s: this.estimate(1.39), vertical_speed_rms_mps: this.estimate((h.value / 4) * 4.8),
      directional: { from_deg: 241, from_error_deg: 7, spread_deg: 24, wavelength_peak_m: 3.1 },
      quality: [], calm: { local: point(leader.at), from: this.stamp(), error_share: 0.6, windows: [{ from: this.stamp(), to: this.stamp(4) }] },
      trace: Array.from({ length: Math.floor(window_s * 5) }, (_, i) => ({ t_s: i / 5 - window_s, elevation_m: this.elevation_m(this.t_s() - window_s + i / 5) })),
      verdict: { state, probability: state === 'safe' ? 0.999 : 0.4, reasons, valid_until: this.stamp(VALID_S), expired: false },
    };
  }

  seas() {
    const running = [...this.missions.values()].filter((mission) => !FINAL.includes(mission.phase));
    const fresh = running.map((mission) => this.sea(mission)).find(Boolean);
    if (fresh) this.lastSea = fresh;
    return fresh ? [fresh] : [];
  }

  task(vehicle) {
    const mission = [...this.missions.values()].find((one) => !FINAL.includes(one.phase) && (one.leader === vehicle.id || one.follower === vehicle.id));
    if (vehicle.kind === 'returning') return { kind: 'return' };
    if (!mission) return null;
    if (vehicle.kind === 'following') return { kind: 'follow', leader: mission.leader, slot: SLOT };
    if (vehicle.kind === 'approaching' || vehicle.kind === 'descending') {
      const valid_until = this.stamp(VALID_S);
      return {
        kind: 'land', point: point(mission.point), approach_height_m: 5,
        clearance: { verdict: 'safe', sea_state_stamp: this.stamp(), valid_until, expired: false },
      };
    }
    return { kind: 'survey', point: point(mission.clear ?? mission.point), height_m: mission.survey_height_m, heading_deg: null };
  }

  plan() {
    const assignments = this.vehicles.map((one) => ({ vehicle: one.id, task: this.task(one) })).filter((one) => one.task !== null);
    const running = [...this.missions.values()].find((one) => !FINAL.includes(one.phase));
    return { generation: this.generation, stamp: this.stamp(), age_s: 0, mission: running?.id ?? null, valid_until: this.stamp(5), expired: false, assignments };
  }

  vehicleJson(one) {
    const onGround = one.height_m <= 0;
    const climbing = !onGround && one.height_m < 2 && one.height_goal_m > one.height_m;
    const kind = climbing || (onGround && one.height_goal_m > 0) ? 'taking_off' : one.kind;
    const settled = kind === 'holding' || kind === 'following' ? one.there : null;
    const global = point(one.at);
    return {
      id: one.id, role: one.role, stamp: this.stamp(), age_s: 0.04, stale: false,
      position: { latitude_deg: global.latitude_deg, longitude_deg: global.longitude_deg, altitude_m: one.height_m }, local: { ...one.at, height_m: one.height_m },
      velocity: { ...one.velocity, down_mps: 0 }, heading_deg: one.heading_deg, roll_deg: 0, pitch_deg: 0,
      mode: one.kind === 'returning' ? 'RTL' : one.kind === 'descending' ? 'LAND' : onGround ? 'STABILIZE' : 'GUIDED',
      armed: !onGround, landed: onGround ? 'on_ground' : kind === 'taking_off' ? 'taking_off' : kind === 'descending' ? 'landing' : 'in_air',
      battery_percent: one.battery, battery_v: 14.1 + one.battery * 0.02, fix: { kind: '3d', satellites: 15, horizontal_sigma_m: 0.8 },
      estimator_ok: true, ready_to_arm: true, boot_s: this.t_s() + 40,
      activity: { kind, settled, slot_error_m: kind === 'following' ? one.away_m ?? null : null, reason: null }, plan_generation: this.generation,
      home: { latitude_deg: point(one.home).latitude_deg, longitude_deg: point(one.home).longitude_deg, altitude_m: 0 }, touchdown: one.touchdown ? point(one.touchdown) : null,
      acceleration: { north_mps2: 0, east_mps2: 0, down_mps2: 0 }, range_m: onGround || one.height_m > 40 ? null : one.height_m,
      ages: { mode_s: 0.4, attitude_s: 0.05, landed_s: 0.4, battery_s: 0.4, fix_s: 0.2, estimator_s: 0.2, home_s: 1.5 },
      link: { loss_percent: 0.4, round_trip_ms: 12, received: 40 * Math.floor(this.t_s()), signed: false },
      firmware: { autopilot: 'ArduPilot', vehicle: 'quadrotor', version: '4.6.0' }, has_payload: false,
    };
  }

  missionJson(one) {
    const { since_s, clear, resumeTo, ...rest } = one;
    return {
      ...rest, age_s: 0, point: point(one.point), touchdown: one.touchdown ? point(one.touchdown) : null,
      touchdown_error_m: one.touchdown ? distance(one.touchdown, one.point) : null, release_problem: null, can: can(one),
    };
  }

  services() {
    const onLeader = ['capture', 'reconstruction', 'wave-assessment'].map((name) => [name, `${name}.leader-1`]);
    const links = this.vehicles.map((one) => ['vehicle-link', `vehicle-link.${one.id}`]);
    return [...onLeader, ...links, ['mission-planner', 'mission-planner'], ['recorder', 'recorder'], ['gateway', 'gateway'], ['sim', 'sim']].map(
      ([service, instance]) => ({
        instance, service, state: 'ready', detail: service === 'reconstruction' ? '5.0 patches/s, 31 ms each' : 'working', restarts: 0,
        uptime_s: this.t_s(), version: '0.1.0', stamp: this.stamp(), age_s: 0.2, stale: false,
      }),
    );
  }

  hello() {
    return { api: 'v1', version: 'mock', fleet: 'mock', origin: ORIGIN, now: this.stamp(), speed: this.speed };
  }
}
