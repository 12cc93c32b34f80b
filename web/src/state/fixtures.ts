/** Whole, valid nouns for tests; each test states only what matters to it. */
import type { Event, Mission, Possibility, SeaState, Vehicle } from '../api/types';

export const T0 = Date.parse('2026-06-01T10:00:00.000Z');
export const stamp = (offset_s: number): string => new Date(T0 + offset_s * 1000).toISOString();

const place = { latitude_deg: 60, longitude_deg: 24, north_m: 60, east_m: 20 };
const no: Possibility = { allowed: false, why: 'not in this test' };

export const vehicle = (over: Partial<Vehicle> = {}): Vehicle => ({
  id: 'leader-1', role: 'leader', stamp: stamp(0), age_s: 0, stale: false,
  position: { latitude_deg: 60, longitude_deg: 24, altitude_m: 5 },
  local: { north_m: 0, east_m: 0, height_m: 5 },
  velocity: { north_mps: 0, east_mps: 0, down_mps: 0 },
  heading_deg: 0, roll_deg: 0, pitch_deg: 0, mode: 'GUIDED', armed: true, landed: 'in_air', battery_percent: 80, battery_v: 15.2,
  fix: { kind: '3d', satellites: 14, horizontal_sigma_m: 0.8 }, estimator_ok: true, ready_to_arm: true, boot_s: 100,
  activity: { kind: 'holding', settled: true, slot_error_m: null, reason: null }, plan_generation: 3, home: null, touchdown: null,
  acceleration: null, range_m: null, link: null, firmware: null, has_payload: false,
  ages: { mode_s: 0.1, attitude_s: 0.1, landed_s: 0.1, battery_s: 0.5, fix_s: 0.2, estimator_s: 0.2, home_s: 1 },
  ...over,
});

export const sea = (over: Partial<SeaState> = {}): SeaState => ({
  rig: 'leader-1', stamp: stamp(0), age_s: 0, stale: false, window_start: stamp(-30), window_s: 30, local: place, patches: 150,
  coverage: 0.9, waves: 60, h_mean_m: null, h_s_m: { value: 0.05, low: 0.045, high: 0.056 }, h_max_m: null, h_m0_m: null, t_z_s: null,
  slope_rms_rad: null, h_rms_m: null, h_tenth_m: null, t_p_s: null, t_m01_s: null, t_m02_s: null, t_e_s: null, vertical_speed_rms_mps: null,
  directional: null, quality: [], calm: null, trace: [], verdict: { state: 'safe', probability: null, reasons: [], valid_until: stamp(10), expired: false },
  ...over,
});

export const mission = (over: Partial<Mission> = {}): Mission => ({
  id: 'm-1', name: 'North bay', stamp: stamp(0), age_s: 0, point: place, survey_height_m: 5, approval: 'manual', dispatch_on_approval: true,
  phase: 'waiting', leader: null, follower: null, verdict: null, h_s_m: null, touchdown: null, touchdown_error_m: null, release_problem: null, history: [],
  can: { approve: no, dispatch: no, pause: no, resume: no, abort: no, release: no, skip_release: no },
  ...over,
});

export const event = (sequence: number, over: Partial<Event> = {}): Event => ({
  sequence, stamp: stamp(sequence), source: 'mission-planner', severity: 'info', what: `event ${sequence}`, why: '', vehicle: null, mission: null,
  ...over,
});
