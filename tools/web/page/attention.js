// What needs a person, in the order in which somebody should look at it. Pure.
//
//   const { concerns, level } = assess(model.plant(), now);
import { milliseconds } from './time.js';

/** A program that was just started may wait a moment for its service; after this time somebody is told. */
const unservedGraceMs = 2000;
/** A queue that lasts this long is worth a look; from the second time on somebody has to do something. */
const waitingLookMs = 5000;
const waitingPersonMs = 60_000;

const rank = { held: 0, gone: 1, 'link down': 2, journal: 2, unserved: 3, aborted: 4, trouble: 5, stuck: 6, waiting: 7, stopped: 8 };

/** The shape of each state or kind of concern, in shapes.js. */
export const shapeOf = {
  idle: 'idle', running: 'running', answering: 'answering', waiting: 'waiting', unserved: 'unserved', held: 'held',
  'link down': 'down', gone: 'down', stuck: 'look', unknown: 'unknown', trouble: 'look',
  aborted: 'down', stopped: 'held', journal: 'down',
};

/** What a channel shows: its state, or what is said of it instead. */
export function stateOf(channel) {
  if (channel.link === 'gone') {
    return 'gone';
  }
  if (channel.link === 'down') {
    return 'link down';
  }
  // A gateway gives a reason for a call that runs only when its time is up and the program waits on.
  if (channel.channel_state === 'running' && channel.reason) {
    return 'stuck';
  }
  // A gateway that takes no new call leaves all of them alone: whether somebody serves them nobody has asked.
  if (channel.channel_state === 'unserved' && channel.journal) {
    return 'journal';
  }
  // A call that waits for an instance, and there is none.
  if (channel.channel_state === 'waiting' && channel.instances === 0) {
    return 'unserved';
  }
  const state = channel.channel_state in shapeOf ? channel.channel_state : 'unknown';
  // A call that needs a person may be why its program was aborted: the cause comes first.
  if (levelOf(state) === 'person' && state !== 'waiting') {
    return state;
  }
  if (channel.program?.state === 'aborted') {
    return 'aborted';
  }
  return state === 'idle' && channel.program?.state === 'held' ? 'stopped' : state;
}

/** How a state looks from afar: "fine", "look" or "person". */
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

/** Since when, in milliseconds; a link that is down or a gateway that is gone knows it better than the channel. */
export function sinceOf(channel, state, links) {
  if (state === 'gone' || state === 'link down') {
    const times = links.filter((link) => !link.connected).map((link) => milliseconds(link.since)).filter(Number.isFinite);
    if (times.length > 0) {
      return Math.max(...times);
    }
  }
  return milliseconds(isOfProgram(state) ? channel.program.since : channel.since);
}

/** The state is of a whole machine: one concern for all its channels. */
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
  if (level === 'fine' || (state === 'unserved' && age < unservedGraceMs)) {
    return null;
  }
  const link = machine.links.find((each) => !each.connected && each.reason);
  const reason = (state === 'gone' || state === 'link down') ? (state === 'gone' ? '' : link?.reason || channel.reason) : isOfProgram(state) ? '' : state === 'journal' ? channel.journal : channel.reason;
  return { machine: machine.name, channels: [channel], kind: state, level, since, reason: reason ?? '', gone: state === 'gone' ? lastOf(machine) : null };
}

/** Where the gateway of a machine was that is gone: { host, pid }; null if nobody knows. */
function lastOf(machine) {
  const link = machine.links.find((each) => each.last_gateway_host);
  return link ? { host: link.last_gateway_host, pid: link.last_gateway_pid } : null;
}

/** A machine of which no channel is known yet, since no gateway has ever reached it. */
function concernOfMachine(machine) {
  const down = machine.links.filter((link) => !link.connected);
  if (machine.channels.length > 0 || down.length === 0 || down.length < machine.links.length) {
    return null;
  }
  const kind = down.every((link) => !link.gateway_host) ? 'gone' : 'link down';
  return {
    machine: machine.name, channels: [], kind, level: 'person', since: milliseconds(down[0].since), reason: kind === 'gone' ? '' : down[0].reason ?? '',
    gone: kind === 'gone' ? lastOf(machine) : null,
  };
}

/** What a program says of itself, where that is not that it is well. */
const concernOfNotice = (notice) => ({
  machine: `${notice.program} @ ${notice.host}`, channels: [], kind: 'trouble', level: notice.level === 'warning' ? 'look' : 'person',
  since: milliseconds(notice.since), reason: notice.text, todo: notice.advice, notice, key: `${notice.responder} ${notice.kind} ${notice.subject}`,
});

/**
 * The concerns of the whole plant (Model.plant()), and how many channels each level has. What a whole machine has in
 * common, a link that is down or a gateway that is gone, is one concern with all its channels. `notices` is what programs
 * say of themselves; a service that a gateway has lost stands among the services, and concerns those that call it.
 */
export function assess(plant, now, notices = []) {
  const concerns = notices.filter((notice) => notice.level !== 'fine' && notice.kind !== 'service').map(concernOfNotice);
  const programs = concerns.filter((concern) => concern.level === 'person').length;
  const counts = { person: 0, look: 0, machines: 0, programs };
  for (const machine of plant) {
    const alone = concernOfMachine(machine);
    if (alone) {
      concerns.push(alone);
      counts.machines += 1;
    }
    const common = new Map();
    for (const channel of machine.channels) {
      const concern = concernOf(machine, channel, now);
      if (!concern) {
        continue;
      }
      counts[concern.level] += 1;
      const shared = isOfMachine(concern.kind) && common.get(concern.kind);
      if (shared) {
        shared.channels.push(channel);
        continue;
      }
      common.set(concern.kind, concern);
      concerns.push(concern);
    }
  }
  // What a gateway says of its journal stands with the channels that wait for it.
  const explained = new Set(plant.filter((machine) => concerns.some((concern) => concern.kind === 'journal' && concern.machine === machine.name))
    .flatMap((machine) => machine.links.map((link) => link.gateway)));
  const isExplained = (concern) => concern.notice?.kind === 'journal' && explained.has(concern.notice.responder);
  counts.programs -= concerns.filter((concern) => isExplained(concern) && concern.level === 'person').length;
  concerns.splice(0, concerns.length, ...concerns.filter((concern) => !isExplained(concern)));
  const order = (concern) => [concern.level === 'person' ? 0 : 1, rank[concern.kind] ?? 9, concern.since];
  concerns.sort((a, b) => {
    const [left, right] = [order(a), order(b)];
    const i = left.findIndex((value, at) => value !== right[at]);
    return i < 0 ? 0 : left[i] - right[i];
  });
  const level = concerns.some((concern) => concern.level === 'person') ? 'person' : concerns.length > 0 ? 'look' : 'fine';
  return { concerns, counts, level };
}

/** Stays the same while a concern lasts. */
export function concernKey(concern) {
  const [channel] = concern.channels;
  return [channel?.machine ?? concern.machine, concern.kind, concern.key ?? channel?.channel ?? '', channel?.call ?? ''].join('\u0000');
}

/** What it concerns, as it is named everywhere: "cnc/1", "cnc.ALARMS/1", or "cnc" for all of a machine. */
export function concernName(concern) {
  const [channel] = concern.channels;
  return concern.channels.length === 1 ? `${channel.machine ?? concern.machine}/${channel.channel}` : concern.machine;
}
