/** Which mission is shown, and the point of one that is being made. */
import { computed, signal } from '@preact/signals';
import { selection } from '../../lib/url-state';
import type { Place } from '../../scene/projection';
import { missions } from '../../state/store';
import { chooseMission } from './progress';

/** The proposed point of a mission that does not exist yet. */
export const draft = signal<Place | null>(null);

export const allMissions = computed(() => Object.values(missions.value).map((heard) => heard.value));

/** The mission to show; `null` while there is none. */
export const selectedMission = computed(() => chooseMission(allMissions.value, selection.value.mission));

/** Whether the form is shown rather than a mission. */
export const creating = computed(() => selection.value.mission === 'new' || selectedMission.value === null);
