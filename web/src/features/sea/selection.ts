/** The rig whose measurements are shown, and what may be said about them. */
import { computed } from '@preact/signals';
import { selection } from '../../lib/url-state';
import { fleetNow_ms, phase, seas } from '../../state/store';
import { selectedMission } from '../missions/selection';
import { chooseRig, judge } from './judgement';

export const rig = computed(() => chooseRig(seas.value, selection.value.rig, selectedMission.value));
export const sea = computed(() => (rig.value === null ? undefined : seas.value[rig.value]));
export const judgement = computed(() => judge(sea.value, phase.value, fleetNow_ms.value));
