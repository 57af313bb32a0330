// Reasons of a gateway that the page words for an operator; all others are shown as they are.
import { rewording } from './reasons.js';

export const inEnglish = rewording([
  ['{} is lost with this call, which must not run twice; an operator must answer or retry it', '{} exited during this call, which may run only once.'],
  ['{} is deaf with this call, which must not run twice; an operator must answer or retry it', '{} does not accept this call, which may run only once.'],
  ['{}, which is gone, may have given this call out; it must not run twice: an operator must answer or retry it',
    '{} ended and may already have dispatched this call, which may run only once.'],
  ['{} (pid {} on {})', '{0} ({2}, pid {1})'],
  ['{} {} is served by nobody; its last instance was {}', 'No service has the UUID {1}. Its last instance was {2}.'],
  ['{} is served by nobody; did you mean {}, {}', 'No service has this UUID. Did you mean {1}? ({2})'],
  ['{} is served by nobody', 'No service has this UUID.'],
]);
