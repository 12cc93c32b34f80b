/** What can be done with a mission, in the words of `gateway/src/core/can.rs`. */
export const FINAL = ['completed', 'aborted', 'failed'];

const yes = { allowed: true, why: '' };
const no = (why) => ({ allowed: false, why });

export function can({ phase }) {
  if (FINAL.includes(phase)) {
    const ended = no({ completed: 'The mission is completed', aborted: 'The mission was aborted', failed: 'The mission has failed' }[phase]);
    return { approve: ended, dispatch: ended, pause: ended, resume: ended, abort: ended, release: ended, skip_release: ended };
  }
  const early = { waiting: 'The water is not measured yet', transit: 'The water is not measured yet', assessing: 'There is no safe verdict yet', paused: 'The mission is paused' }[phase];
  return {
    approve: phase === 'awaiting_approval' ? yes : no(early ?? 'It is approved already'),
    dispatch: phase === 'awaiting_approval' || phase === 'approved' ? yes : no(early ?? 'The follower is on its way already'),
    pause: phase === 'paused' ? no('The mission is paused already') : yes,
    resume: phase === 'paused' ? yes : no('The mission is not paused'),
    abort: yes,
    release: no('The follower has not landed yet'),
    skip_release: no('The follower has not landed yet'),
  };
}
