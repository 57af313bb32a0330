// Reasons of a gateway, reworded for an operator; all others are shown unchanged.
import { rewording } from './reasons.js';

export const inEnglish = rewording([
  ['{} is lost during this call, which must not run twice; an operator must answer or retry it', '{} exited during this call, which may run only once.'],
  ['{} is deaf during this call, which must not run twice; an operator must answer or retry it', '{} does not accept this call, which may run only once.'],
  ['{} is gone and may have dispatched this call, which must not run twice; an operator must answer or retry it',
    '{} ended and may already have dispatched this call, which may run only once.'],
  ['{} (pid {} on {})', '{0} ({2}, pid {1})'],
  ['no instance serves {}; the last one was {}', 'No service has the UUID {}. Its last instance was {}.'],
  ['no service has the UUID {}; did you mean {}, {}', 'No service has this UUID. Did you mean {1}? ({2})'],
  ['no service has the UUID {}', 'No service has this UUID.'],
]);
