// Sentences of the processes, reworded for an operator, by their code; all others are shown as they come.
export const messages = {
  instance_lost_held: '{0} exited during this call, which may run only once.',
  instance_deaf_held: '{0} does not accept this call, which may run only once.',
  gateway_lost_held: '{0} ended and may already have dispatched this call, which may run only once.',
  no_instance: 'No service has the UUID {0}. Its last instance was {1}.',
  unknown_uuid_near: 'No service has this UUID. Did you mean {1}? ({2})',
  unknown_uuid: 'No service has this UUID.',
};
