/** From what a person typed to a request, or what is wrong with it, field by field. Pure. */
import type { Approval, CreateMission } from '../../api/types';

export interface FormText {
  name: string;
  north: string;
  east: string;
  height: string;
  approval: Approval;
  /** Empty: the planner chooses. */
  leader: string;
  follower: string;
}

export type FormErrors = Partial<Record<'name' | 'north' | 'east' | 'height', string>>;
export type FormResult = { ok: true; mission: CreateMission } | { ok: false; errors: FormErrors };

/** The gateway's own bounds on a local point and on a survey height, metres. */
const REACH_M = 100_000;
const HEIGHT_M_MAX = 1000;
const NAME_MAX = 200;

/** A number as people type it: a comma will do, and the minus sign that we show ourselves. */
export function readNumber(text: string): number | null {
  const plain = text.trim().replace(',', '.').replace('\u2212', '-');
  if (!/^[+-]?(\d+\.?\d*|\.\d+)$/.test(plain)) return null;
  return Number(plain);
}

export function checkForm(text: FormText): FormResult {
  const errors: FormErrors = {};
  const place = (what: 'north' | 'east'): number => {
    const value = readNumber(text[what]);
    if (value === null) errors[what] = 'A number of metres, or click on the map';
    else if (Math.abs(value) > REACH_M) errors[what] = 'At most 100 km away';
    return value ?? 0;
  };
  const [north_m, east_m] = [place('north'), place('east')];
  const height_m = readNumber(text.height) ?? 0;
  if (!(height_m > 0 && height_m <= HEIGHT_M_MAX)) errors.height = 'More than 0 and at most 1000 m';
  const name = text.name.trim();
  if (name.length > NAME_MAX) errors.name = `At most ${NAME_MAX} characters`;
  if (Object.keys(errors).length > 0) return { ok: false, errors };
  return {
    ok: true,
    mission: {
      point: { north_m, east_m },
      ...(name === '' ? {} : { name }),
      survey_height_m: height_m,
      approval: text.approval,
      dispatch_on_approval: true,
      ...(text.leader === '' ? {} : { leader: text.leader }),
      ...(text.follower === '' ? {} : { follower: text.follower }),
    },
  };
}
