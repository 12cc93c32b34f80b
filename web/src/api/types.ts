/** The nouns of the REST contract (`gateway/src/api/dto`), under the names that this page uses. */

/** RFC 3339, UTC, milliseconds, on the fleet's clock. */
export type Stamp = string;

export interface Point {
  latitude_deg: number;
  longitude_deg: number;
  north_m: number;
  east_m: number;
}

export interface Global {
  latitude_deg: number;
  longitude_deg: number;
  altitude_m: number;
}

export interface Estimate {
  value: number;
  low: number;
  high: number;
}

export type ActivityKind =
  | 'idle' | 'preparing' | 'taking_off' | 'transit' | 'holding' | 'following' | 'approaching' | 'descending' | 'landed'
  | 'returning' | 'fail_safe' | 'pilot_control';

export interface Activity {
  kind: ActivityKind;
  settled: boolean | null;
  slot_error_m: number | null;
  reason: string | null;
}

export type FixKind = 'no_gps' | 'no_fix' | '2d' | '3d' | 'dgps' | 'rtk_float' | 'rtk_fixed' | 'other';

export interface Fix {
  kind: FixKind;
  satellites: number;
  horizontal_sigma_m: number | null;
}

export type Role = 'leader' | 'follower';
export type LandedState = 'unknown' | 'on_ground' | 'taking_off' | 'in_air' | 'landing';

export interface Vehicle {
  id: string;
  role: Role;
  stamp: Stamp;
  age_s: number;
  stale: boolean;
  position: Global;
  local: { north_m: number; east_m: number; height_m: number };
  velocity: { north_mps: number; east_mps: number; down_mps: number };
  heading_deg: number;
  roll_deg: number;
  pitch_deg: number;
  mode: string;
  armed: boolean;
  landed: LandedState;
  battery_percent: number | null;
  battery_v: number | null;
  fix: Fix | null;
  estimator_ok: boolean;
  ready_to_arm: boolean;
  boot_s: number;
  activity: Activity;
  plan_generation: number;
  home: Global | null;
  touchdown: Point | null;
}

export type VerdictState = 'safe' | 'unsafe' | 'inconclusive';

export interface VerdictCheck {
  check: string;
  passed: boolean;
  text: string;
}

export interface Verdict {
  state: VerdictState;
  reasons: VerdictCheck[];
  valid_until: Stamp;
  expired: boolean;
}

export interface TraceSample {
  t_s: number;
  elevation_m: number;
}

export interface SeaState {
  rig: string;
  stamp: Stamp;
  age_s: number;
  stale: boolean;
  window_start: Stamp;
  window_s: number;
  local: Point;
  patches: number;
  coverage: number;
  waves: number;
  h_mean_m: Estimate | null;
  h_s_m: Estimate | null;
  h_max_m: Estimate | null;
  h_m0_m: Estimate | null;
  t_z_s: Estimate | null;
  slope_rms_rad: Estimate | null;
  trace: TraceSample[];
  verdict: Verdict;
}

export type MissionPhase =
  | 'waiting' | 'transit' | 'assessing' | 'awaiting_approval' | 'approved' | 'joining' | 'clearing' | 'landing' | 'paused'
  | 'completed' | 'aborted' | 'failed';

export interface MissionTransition {
  stamp: Stamp;
  phase: MissionPhase;
  who: string;
  why: string;
}

export interface Possibility {
  allowed: boolean;
  why: string;
}

export interface MissionAbilities {
  approve: Possibility;
  dispatch: Possibility;
  pause: Possibility;
  resume: Possibility;
  abort: Possibility;
}

export type Approval = 'manual' | 'automatic';

export interface Mission {
  id: string;
  name: string;
  stamp: Stamp;
  age_s: number;
  point: Point;
  survey_height_m: number;
  approval: Approval;
  dispatch_on_approval: boolean;
  phase: MissionPhase;
  leader: string | null;
  follower: string | null;
  verdict: VerdictState | null;
  h_s_m: Estimate | null;
  touchdown: Point | null;
  touchdown_error_m: number | null;
  history: MissionTransition[];
  can: MissionAbilities;
}

export interface CreateMission {
  point: { latitude_deg: number; longitude_deg: number } | { north_m: number; east_m: number };
  name?: string;
  survey_height_m?: number;
  approval?: Approval;
  dispatch_on_approval?: boolean;
  leader?: string;
  follower?: string;
}

export interface SlotOffset {
  forward_m: number;
  right_m: number;
  up_m: number;
}

export interface LandingClearance {
  verdict: VerdictState;
  sea_state_stamp: Stamp;
  valid_until: Stamp;
  expired: boolean;
}

export type PlanTask =
  | { kind: 'hold' }
  | { kind: 'survey'; point: Point; height_m: number; heading_deg: number | null }
  | { kind: 'follow'; leader: string; slot: SlotOffset }
  | { kind: 'land'; point: Point; approach_height_m: number; clearance: LandingClearance | null }
  | { kind: 'return' };

export interface PlanAssignment {
  vehicle: string;
  task: PlanTask;
}

export interface Plan {
  generation: number;
  stamp: Stamp;
  age_s: number;
  mission: string | null;
  valid_until: Stamp;
  expired: boolean;
  assignments: PlanAssignment[];
}

export type HealthState = 'starting' | 'ready' | 'degraded' | 'restarting';

export interface Service {
  instance: string;
  service: string;
  state: HealthState;
  detail: string;
  restarts: number;
  uptime_s: number;
  version: string;
  stamp: Stamp;
  age_s: number;
  stale: boolean;
}

export type Severity = 'info' | 'warning' | 'critical';

export interface Event {
  sequence: number;
  stamp: Stamp;
  source: string;
  severity: Severity;
  what: string;
  why: string;
  vehicle: string | null;
  mission: string | null;
}

export interface Preview {
  rig: string;
  stamp: Stamp;
  age_s: number;
  left: string;
  disparity: string;
}

export interface Hello {
  api: string;
  version: string;
  fleet: string;
  origin: Global;
  now: Stamp;
  speed: number;
}

export interface Heartbeat {
  now: Stamp;
}

export interface CommandResult {
  stamp: Stamp;
  accepted: boolean;
  reason: string;
  mission: string | null;
  watch: string;
}

export interface Problem {
  type: string;
  title: string;
  status: number;
  detail: string;
  instance: string;
}

/** One message of the live stream. */
export type StreamMessage =
  | { type: 'hello'; data: Hello }
  | { type: 'heartbeat'; data: Heartbeat }
  | { type: 'vehicle'; data: Vehicle }
  | { type: 'sea_state'; data: SeaState }
  | { type: 'mission'; data: Mission }
  | { type: 'plan'; data: Plan }
  | { type: 'service'; data: Service }
  | { type: 'event'; data: Event };
