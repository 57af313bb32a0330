// Finding machines and services by a part of their names, and the order of services. Pure.
import { byName, channelName } from './model.js';

/** Whether one of the texts has `wanted` in it; upper and lower case are the same. */
export function hits(wanted, texts) {
  const small = wanted.trim().toLowerCase();
  return texts.some((text) => text?.toLowerCase().includes(small));
}

/** The machines of Model.plant() whose name has `wanted` in it; of others the channels whose name or service has. */
export function machinesWith(plant, wanted) {
  return plant.map((machine) => (hits(wanted, [machine.name]) ? machine
    : { ...machine, channels: machine.channels.filter((channel) => hits(wanted, [channelName(channel), channel.service, channel.uuid])) }))
    .filter((machine) => machine.channels.length > 0 || hits(wanted, [machine.name]));
}

/** Whether the name or UUID of a service, or the name or host of an instance, has `wanted` in it. */
export const isService = ({ name, uuid, instances }, wanted) => hits(wanted, [name, uuid, ...instances.flatMap((each) => [each.name, each.host])]);

/** What each column of services is sorted by. */
const values = {
  name: ({ group }) => group.name || group.uuid,
  instances: ({ group }) => group.here,
  busy: ({ load }) => load.busy,
  waiting: ({ load }) => load.waiting,
  rate: ({ load }) => load.rate,
  p50: ({ load }) => load.p50,
  p99: ({ load }) => load.p99,
  errors: ({ load }) => load.errors,
};

/** The order of an address, "rate" or "-rate", as { column, isDescending }; null for none, and for an unknown column. */
export function orderOf(text) {
  const column = text.replace(/^-/, '');
  return Object.hasOwn(values, column) ? { column, isDescending: text.startsWith('-') } : null;
}

/** The order after a click on a column: names begin with A, numbers with the largest; a third click ends it. */
export function nextOrder(text, column) {
  const first = column === 'name' ? column : `-${column}`;
  const second = column === 'name' ? `-${column}` : column;
  return text === first ? second : text === second ? '' : first;
}

/** Services of byTrouble() in an order of orderOf(); those without a value come last. */
export function inOrder(services, order) {
  if (!order) {
    return services;
  }
  const sign = order.isDescending ? -1 : 1;
  const of = values[order.column];
  return [...services].sort((a, b) => {
    const [left, right] = [of(a), of(b)];
    return left === undefined || right === undefined ? (left === undefined) - (right === undefined)
      : sign * (typeof left === 'string' ? byName(left, right) : left - right) || byName(a.group.name, b.group.name);
  });
}
