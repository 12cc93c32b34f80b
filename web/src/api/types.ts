/** The nouns of the REST contract under short names. `schema.gen.ts` is generated (`npm run generate`) from `openapi.json`, which
 * the gateway's tests keep equal to what it serves. */
import type { components } from './schema.gen';

type Schemas = components['schemas'];

export type Activity = Schemas['Activity'];
export type ActivityKind = Schemas['ActivityKind'];
export type Approval = Schemas['Approval'];
export type CommandResult = Schemas['CommandResult'];
export type CreateMission = Schemas['CreateMission'];
export type Estimate = Schemas['Estimate'];
export type Event = Schemas['Event'];
export type Fix = Schemas['Fix'];
export type FixKind = Schemas['FixKind'];
export type Global = Schemas['Global'];
export type HealthState = Schemas['HealthState'];
export type Hello = Schemas['Hello'];
export type LandedState = Schemas['LandedState'];
export type Mission = Schemas['Mission'];
export type MissionPhase = Schemas['MissionPhase'];
export type MissionTransition = Schemas['MissionTransition'];
export type Plan = Schemas['Plan'];
export type PlanTask = Schemas['PlanTask'];
export type Possibility = Schemas['Possibility'];
export type Preview = Schemas['Preview'];
export type Problem = Schemas['Problem'];
export type Role = Schemas['Role'];
export type SeaState = Schemas['SeaState'];
export type Service = Schemas['Service'];
export type Severity = Schemas['Severity'];
export type StreamMessage = Schemas['StreamMessage'];
export type Vehicle = Schemas['Vehicle'];
export type VerdictState = Schemas['VerdictState'];
