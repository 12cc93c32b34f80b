/** REST, version 1. Every failure becomes one {@link ApiError} with a sentence for people. */
import { randomId } from '../lib/id';
import { operator, operatorHeader } from '../lib/operator';
import type { CommandResult, CreateMission, Preview, Problem } from './types';

/** Why a request failed. `message` can be shown as it is. */
export class ApiError extends Error {
  override name = 'ApiError';
  constructor(
    message: string,
    /** HTTP status; 0 when no answer came. */
    readonly status: number,
  ) {
    super(message);
  }
}

/** No request may hang longer than this. */
const TIMEOUT_MS = 10_000;

async function request<T>(path: string, init: RequestInit): Promise<T> {
  let response: Response;
  try {
    response = await fetch(path, { ...init, signal: AbortSignal.timeout(TIMEOUT_MS) });
  } catch (error) {
    const late = error instanceof DOMException && error.name === 'TimeoutError';
    throw new ApiError(late ? 'The gateway did not answer in 10 s. Nothing is known to have happened.' : 'The gateway cannot be reached.', 0);
  }
  const body: unknown = await response.json().catch(() => null);
  if (!response.ok) {
    const problem = (body ?? {}) as Partial<Problem>;
    throw new ApiError(problem.detail ?? problem.title ?? `The gateway answered ${response.status}.`, response.status);
  }
  return body as T;
}

/** A POST under a fresh idempotency key: if the network repeats it, it still happens once. */
const post = <T>(path: string, body?: unknown): Promise<T> =>
  request<T>(path, {
    method: 'POST',
    headers: {
      'idempotency-key': randomId(),
      'halcyon-operator': operatorHeader(operator.peek()),
      ...(body === undefined ? {} : { 'content-type': 'application/json' }),
    },
    ...(body === undefined ? {} : { body: JSON.stringify(body) }),
  });

const segment = encodeURIComponent;

export type MissionAction = 'approve' | 'dispatch' | 'pause' | 'resume' | 'abort' | 'release' | 'skip_release';

export const createMission = (mission: CreateMission): Promise<CommandResult> => post('/api/v1/missions', mission);
export const commandMission = (id: string, action: MissionAction): Promise<CommandResult> => post(`/api/v1/missions/${segment(id)}/${action.replace('_', '-')}`);

/** The newest pictures of a rig, or `null` if there are none yet. */
export async function preview(rig: string): Promise<Preview | null> {
  try {
    return await request<Preview>(`/api/v1/rigs/${segment(rig)}/preview`, { headers: { accept: 'application/json' } });
  } catch (error) {
    if (error instanceof ApiError && error.status === 404) return null;
    throw error;
  }
}
