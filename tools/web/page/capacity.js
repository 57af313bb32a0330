// Which instances of a service serve which channels, and whether one more would help. Pure.
//
//   matrixOf(group, channels, served).rows              // `served` of /api/history
//   adviceOf(group, channels, served, busy, now)        // { kind: 'enough', busy, callers, room, waiting }
import { byName, keyOf } from './model.js';
import { milliseconds } from './time.js';

/** More columns do not fit. */
export const mostColumns = 12;
/** A shorter wait does not count as waiting. */
const waitMs = 1000;
const fullShare = 0.8;
const peakShare = 0.5;

/** Channel scopes are "cnc/1" or "cnc/*"; an instance without scopes serves all channels. */
export function mayServe(service, { machine, channel }) {
  return !service.channels?.length || service.channels.some((scope) => {
    const [ofMachine, number = '*'] = scope.split('/');
    return ['*', machine, machine.split('.')[0]].includes(ofMachine) && (number === '*' || number === String(channel));
  });
}

const wants = (channel, uuid) => channel.uuid?.toLowerCase() === uuid && channel.channel_state !== 'idle';

/** The channels that the instances of a service have served in the last minute, or that call it now. */
function callersOf(group, channels, served) {
  const ids = new Set(group.instances.map((service) => service.instance));
  const found = new Map();
  for (const each of [...served.filter((pair) => ids.has(pair.instance)), ...channels.filter((channel) => wants(channel, group.uuid))]) {
    found.set(keyOf(each.machine, each.channel), { machine: each.machine, channel: each.channel });
  }
  return [...found.values()].sort((a, b) => byName(a.machine, b.machine) || a.channel - b.channel);
}

/**
 * { columns, rows, left }: a column for each channel, or for each machine if there are too many channels; `left` is the
 * number of columns that do not fit. A row is { service, cells }; a cell is calls per second, or null where the channel is
 * outside the instance's scope.
 */
export function matrixOf(group, channels, served) {
  const callers = callersOf(group, channels, served);
  const machines = [...new Set(callers.map((each) => each.machine))].map((machine) => ({ machine, parts: callers.filter((each) => each.machine === machine) }));
  const all = callers.length <= mostColumns ? callers.map((each) => ({ ...each, parts: [each] })) : machines;
  const columns = all.slice(0, mostColumns);
  const rates = new Map();
  for (const pair of served) {
    rates.set(keyOf(pair.instance, keyOf(pair.machine, pair.channel)), pair.calls_per_second);
  }
  const rateOf = (service, { machine, channel }) => rates.get(keyOf(service.instance, keyOf(machine, channel))) ?? 0;
  const rows = group.instances.filter((service) => service.goneAt === undefined).map((service) => ({
    service,
    cells: columns.map(({ parts }) => {
      const sum = parts.reduce((rate, part) => rate + rateOf(service, part), 0);
      return sum > 0 || parts.some((part) => mayServe(service, part)) ? sum : null;
    }),
  }));
  return { columns, rows, left: all.length - columns.length };
}

/**
 * Whether one more instance would help. A channel has one call at a time. So if there is room for a call of each calling
 * channel, it would not, however busy the instances are. `busy` is that of the last minute; null while it is unknown.
 */
export function adviceOf(group, channels, served, busy, now) {
  const here = group.instances.filter((service) => service.goneAt === undefined && !service.draining);
  const room = here.reduce((sum, service) => sum + (service.concurrency || 1), 0);
  const callers = callersOf(group, channels, served);
  const waiting = channels.filter((channel) => wants(channel, group.uuid) && channel.channel_state === 'waiting' && now - milliseconds(channel.since) > waitMs).length;
  const kind = here.length === 0 ? 'none' : waiting > 0 ? 'waiting' : busy === undefined ? 'unknown'
    : busy < peakShare ? 'enough' : callers.length <= room ? 'each' : busy < fullShare ? 'peaks' : 'busy';
  return { kind, busy, callers: callers.length, room, waiting };
}
