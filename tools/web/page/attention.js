// What needs attention: one concern for each cause, the most urgent first. Pure.
//
//   const { concerns, level } = assess(model.plant(), now);
import { messageOf } from './texts/sentences.js';
import { milliseconds } from './time.js';

/** A missing service is a concern after this time, since a new NC program and its service may start together … */
const unknownGraceMs = 2000;
/** … or after this time, if the service was there: it may restart. */
const lostGraceMs = 1000;
/** A call that waits this long is shown as one to watch; after the second time it needs attention. */
const waitingLookMs = 5000;
const waitingPersonMs = 60_000;

const rank = { held: 0, gone: 1, 'link down': 2, journal: 2, unserved: 3, aborted: 4, trouble: 5, stuck: 6, waiting: 7, stopped: 8 };

/** The shape of each state or kind of concern, in shapes.js. */
export const shapeOf = {
  idle: 'idle', running: 'running', answering: 'answering', waiting: 'waiting', unserved: 'unserved', held: 'held',
  'link down': 'down', gone: 'down', stuck: 'look', unknown: 'unknown', trouble: 'look', warning: 'look',
  aborted: 'down', stopped: 'held', journal: 'down',
};

/** The state of a channel's call, or the obstacle for all calls. */
export function callStateOf(channel) {
  if (channel.link === 'gone') {
    return 'gone';
  }
  if (channel.link === 'down') {
    return 'link down';
  }
  if (channel.channel_state === 'running' && channel.reason_code === 'deadline') {
    return 'stuck';
  }
  // Without a journal the gateway accepts no calls, and has not looked for a service.
  if (channel.channel_state === 'unserved' && channel.journal) {
    return 'journal';
  }
  // The call waits for an instance, and there is none.
  if (channel.channel_state === 'waiting' && channel.instances === 0) {
    return 'unserved';
  }
  return channel.channel_state in shapeOf ? channel.channel_state : 'unknown';
}

/** The state of a channel: that of its call, or that of its NC program. */
export function stateOf(channel) {
  const state = callStateOf(channel);
  // A call that needs a person may have aborted the program: the cause comes first.
  if (levelOf(state) === 'person' && state !== 'waiting') {
    return state;
  }
  if (channel.program?.state === 'aborted') {
    return 'aborted';
  }
  return state === 'idle' && channel.program?.state === 'on hold' ? 'stopped' : state;
}

/** The level of a state: "fine", "look" or "person". */
export function levelOf(state, ageMs = Infinity) {
  switch (state) {
    case 'held':
    case 'gone':
    case 'link down':
    case 'journal':
    case 'unserved':
    case 'aborted':
      return 'person';
    case 'waiting':
      return ageMs < waitingLookMs ? 'fine' : ageMs < waitingPersonMs ? 'look' : 'person';
    case 'stuck':
    case 'stopped':
    case 'unknown':
      return 'look';
    default:
      return 'fine';
  }
}

/** No service with this UUID was ever seen. */
export const isUnknownUuid = ({ reason_code: code }) => code?.startsWith('unknown_uuid') ?? false;

/** How long a state is no concern yet. */
const graceOf = (channel, state) => (state !== 'unserved' ? 0 : isUnknownUuid(channel) ? unknownGraceMs : lostGraceMs);

/** Begin of a state in milliseconds; for a link or a gateway that is down, the link has the exact time. */
export function sinceOf(channel, state, links) {
  if (state === 'gone' || state === 'link down') {
    const times = links.filter((link) => !link.connected).map((link) => milliseconds(link.since)).filter(Number.isFinite);
    if (times.length > 0) {
      return Math.max(...times);
    }
  }
  return milliseconds(isOfProgram(state) ? channel.program.since : channel.since);
}

/** The state is of a whole machine. */
function isOfMachine(state) {
  return state === 'gone' || state === 'link down' || state === 'journal';
}

/** The state is of the NC program, not of its call. */
export function isOfProgram(state) {
  return state === 'aborted' || state === 'stopped';
}

function concernOf(machine, channel, now) {
  const state = stateOf(channel);
  const since = sinceOf(channel, state, machine.links);
  const age = Number.isFinite(since) ? now - since : Infinity;
  const level = levelOf(state, age);
  if (level === 'fine' || age < graceOf(channel, state)) {
    return null;
  }
  const link = machine.links.find((each) => !each.connected && each.reason);
  const reason = (state === 'gone' || state === 'link down') ? (state === 'gone' ? '' : messageOf(link ?? channel, 'reason')) : isOfProgram(state) ? '' : messageOf(channel, state === 'journal' ? 'journal' : 'reason');
  return {
    machines: [machine.name], channels: [channel], kind: state, level, since, reason: reason ?? '', why: channel.reason_code, gone: state === 'gone' ? lastOf(machine) : null,
    cause: causeOf(machine, channel, state),
  };
}

/** Key of the common cause of concerns: a gateway, a controller, a service; else the channel itself. */
function causeOf(machine, channel, state) {
  const gateways = machine.links.map((link) => link.gateway ?? '').sort().join(' ');
  switch (state) {
    case 'gone':
    case 'journal':
      return `${state} ${gateways || machine.name}`;
    case 'link down':
      return `${state} ${machine.name}`;
    case 'unserved':
    case 'waiting':
      return channel.uuid ? `${state} ${channel.uuid.toLowerCase()}` : `${state} ${channel.machine}/${channel.channel}`;
    default:
      return `${state} ${channel.machine}/${channel.channel}`;
  }
}

/** Place of a gateway that is gone, and whether it kept a journal: { host, pid, journal }; null if unknown. */
function lastOf(machine) {
  const link = machine.links.find((each) => each.last_gateway_host);
  return link ? { host: link.last_gateway_host, pid: link.last_gateway_pid, journal: link.last_gateway_journal } : null;
}

/** A machine without known channels, because no gateway has reached it yet. */
function concernOfMachine(machine) {
  const down = machine.links.filter((link) => !link.connected);
  if (machine.channels.length > 0 || down.length === 0 || down.length < machine.links.length) {
    return null;
  }
  const kind = down.every((link) => link.gone) ? 'gone' : 'link down';
  return {
    machines: [machine.name], channels: [], kind, level: 'person', since: milliseconds(down[0].since), reason: kind === 'gone' ? '' : messageOf(down[0], 'reason'),
    gone: kind === 'gone' ? lastOf(machine) : null, cause: causeOf(machine, {}, kind),
  };
}

/** The concern of an alarm: a problem or a warning. */
const concernOfAlarm = (alarm) => ({
  machines: [`${alarm.program} @ ${alarm.host}`], channels: [], kind: 'trouble', level: alarm.level === 'warning' ? 'look' : 'person',
  since: milliseconds(alarm.since), reason: messageOf(alarm, 'text'), todo: messageOf(alarm, 'advice'), alarm, cause: `trouble ${alarm.responder} ${alarm.kind} ${alarm.subject}`,
});

/** Adds a concern, or merges it with one of the same cause; the worst level and the longest time count. */
function put(causes, concern) {
  const known = causes.get(concern.cause);
  if (!known) {
    causes.set(concern.cause, concern);
    return;
  }
  known.machines = [...new Set([...known.machines, ...concern.machines])];
  const isOlder = concern.since < known.since;
  known.channels = isOlder ? [...concern.channels, ...known.channels] : [...known.channels, ...concern.channels];
  known.reason = isOlder && concern.reason ? concern.reason : known.reason || concern.reason;
  known.since = isOlder ? concern.since : known.since;
  known.level = concern.level === 'person' ? 'person' : known.level;
}

/**
 * The concerns of the whole plant (Model.plant()), one for each cause: a gateway that is gone is one with all its machines,
 * a service without an instance is one with all channels that wait for it. `counts` are of channels, machines without
 * channels, and processes; `causes` of concerns that need attention. `alarms` are those of all processes. The alarm of a
 * service that a gateway has lost is not listed: it belongs to the services, and to the channels that call them.
 */
export function assess(plant, now, alarms = []) {
  const causes = new Map();
  const counts = { person: 0, look: 0, machines: 0, programs: 0 };
  for (const machine of plant) {
    const alone = concernOfMachine(machine);
    if (alone) {
      put(causes, alone);
      counts.machines += 1;
    }
    for (const channel of machine.channels) {
      const concern = concernOf(machine, channel, now);
      if (concern) {
        counts[concern.level] += 1;
        put(causes, concern);
      }
    }
  }
  // The alarm of a gateway's journal is shown with the channels that wait for it.
  const blocked = new Set([...causes.values()].filter(({ kind }) => kind === 'journal').flatMap(({ machines }) => machines));
  const explained = new Set(plant.filter(({ name }) => blocked.has(name)).flatMap(({ links }) => links.map((link) => link.gateway)));
  for (const alarm of alarms) {
    if (alarm.level !== 'fine' && alarm.kind !== 'service' && !(alarm.kind === 'journal' && explained.has(alarm.responder))) {
      const concern = concernOfAlarm(alarm);
      counts.programs += concern.level === 'person' ? 1 : 0;
      // Two processes may report the same.
      causes.set(causes.has(concern.cause) ? `${concern.cause} ${causes.size}` : concern.cause, concern);
    }
  }
  const concerns = [...causes.values()];
  const order = (concern) => [concern.level === 'person' ? 0 : 1, rank[concern.kind] ?? 9, concern.since];
  concerns.sort((a, b) => {
    const [left, right] = [order(a), order(b)];
    const i = left.findIndex((value, at) => value !== right[at]);
    return i < 0 ? 0 : left[i] - right[i];
  });
  counts.causes = concerns.filter((concern) => concern.level === 'person').length;
  const level = counts.causes > 0 ? 'person' : concerns.length > 0 ? 'look' : 'fine';
  return { concerns, counts, level };
}

/** Milliseconds until the next grace time ends; Infinity if none runs. */
export function nextConcernIn(plant, now) {
  const waits = plant.flatMap((machine) => machine.channels.map((channel) => {
    const state = stateOf(channel);
    return sinceOf(channel, state, machine.links) + graceOf(channel, state) - now;
  }));
  return Math.min(Infinity, ...waits.filter((wait) => wait > 0));
}

/** Stays the same while a concern lasts; the next call of the same channel has another key. */
export function concernKey(concern) {
  return `${concern.cause}\u0000${concern.kind === 'held' || concern.kind === 'stuck' ? concern.channels[0].call ?? '' : ''}\u0000${concern.level}`;
}

/** The key for acknowledgements: the same for all levels of a cause. */
export const acknowledgeKey = (concern) => concernKey({ ...concern, level: '' });

/**
 * The acknowledgement of a concern among those that the server keeps; null if there is none. A concern that began after the
 * acknowledgement is a new one, by the clock of the gateway that reports the begin, or by that of the server.
 */
export function acknowledgementOf(concern, acknowledged) {
  const found = acknowledged.find((each) => each.cause === acknowledgeKey(concern));
  return found && !(concern.since > Math.max(Number(found.since) || 0, milliseconds(found.time))) ? found : null;
}

const nameOf = (channel) => `${channel.machine}/${channel.channel}`;

/** The subject of a concern: "cnc/1", "cnc.ALARMS/1", or the machines that are affected as a whole. */
export function concernName(concern) {
  return concern.channels.length === 0 || isOfMachine(concern.kind) ? concern.machines.join(', ') : nameOf(concern.channels[0]);
}

/** The other channels with the same cause. */
export const otherChannels = (concern) => (isOfMachine(concern.kind) ? [] : concern.channels.slice(1).map(nameOf));
