// The page's model of the plant: a snapshot, then changes. Pure: it uses no document, no connection and no clock.
//
//   const model = new Model();
//   model.takeSnapshot(data, Date.now());
//   model.takeChanges(data, Date.now());
//   model.now(Date.now())                     // server time, which all times are compared with
import { worstOf } from './concerns.js';
import { milliseconds } from './time.js';

export const keptCalls = 400;
export const keptEvents = 100;
/** An instance that is gone stays on the page this long. */
export const keptGoneMs = 15 * 60_000;

/** "ALARMS" of "cnc.ALARMS", where `machine` is "cnc"; nothing for a channel of the machine itself. */
export const queueOf = (channel, machine) => (channel.machine.startsWith(`${machine}.`) ? channel.machine.slice(machine.length + 1) : '');

/** The machine of a channel: a message queue belongs to its machine, if that is known; other channels to their own. */
const ownerOf = (channel, names) => {
  const machine = channel.machine.split('.')[0];
  return names.has(machine) ? machine : channel.machine;
};

/** A key of a machine and something in it, such as a channel. */
export const keyOf = (machine, part) => `${machine}\u0000${part}`;

/** "cnc/1", the usual form. */
export const channelName = (channel) => `${channel.machine}/${channel.channel}`;

/** The command that made a call without a controller, "millrace call"; nothing for a call of a machine. */
export const toolOf = (call) => (/^(call|replay)\.[0-9a-f]{8}/.exec(call.machine) ?? []).slice(1).map((word) => `millrace ${word}`)[0] ?? '';

export class Model {
  /** Null until the first snapshot. */
  about = null;
  totals = null;
  machines = new Map();
  channels = new Map();
  /** Instances; those that are gone have `goneAt`, in milliseconds. */
  services = new Map();
  /** What needs attention, the worst first. */
  concerns = [];
  /** Acknowledgements: [{ cause, since, by, note, time }]. */
  acknowledged = [];
  /** Events of /api/events, the newest first. */
  events = [];
  /**
   * Newest first: calls, and entries for missing ones: { skipped: number } or { gap: { from, to } }, in milliseconds.
   */
  calls = [];
  /** The last time without data: { from, to, otherServer }; null if there was none, or the reader has closed it. */
  gap = null;

  #offset = 0;
  #lastHeard = NaN;
  #lostAt = NaN;

  /** Server time; without a connection the time of the last message. */
  now(browserTime) {
    return (Number.isFinite(this.#lostAt) ? this.#lastHeard : browserTime) + this.#offset;
  }

  /** Server time minus browser time, in milliseconds. */
  get offset() {
    return this.#offset;
  }

  /** Browser time of the last message; NaN if there was none. */
  get lastHeard() {
    return this.#lastHeard;
  }

  /** True from the loss of the connection to the next snapshot. */
  get isLost() {
    return Number.isFinite(this.#lostAt);
  }

  lose(browserTime) {
    if (!this.isLost) {
      this.#lostAt = browserTime;
    }
  }

  takeSnapshot(data, browserTime) {
    const again = this.about !== null;
    const otherServer = again && this.about.started !== data.about.started;
    const gap = again ? { from: this.#lastHeard, to: browserTime, otherServer } : null;
    if (again && (this.isLost || otherServer)) {
      this.gap = gap;
    }
    this.#hear(data.about.time, browserTime);
    this.#lostAt = NaN;
    this.about = data.about;
    this.totals = data.totals;
    this.machines = new Map();
    this.channels = new Map();
    this.events = [];
    this.services = new Map();
    this.#merge(data, browserTime);
    this.#mergeCalls(data.calls ?? [], gap);
  }

  takeChanges(data, browserTime) {
    this.#hear(data.time, browserTime);
    this.totals = data.totals ?? this.totals;
    this.#merge(data, browserTime);
    for (const { machine, channel } of data.gone?.channels ?? []) {
      this.channels.delete(keyOf(machine, channel));
    }
    for (const { machine, gateway } of data.gone?.machines ?? []) {
      this.machines.delete(keyOf(machine, gateway));
    }
    for (const id of data.gone?.services ?? []) {
      const known = this.services.get(id);
      if (known && known.goneAt === undefined) {
        this.services.set(id, { ...known, goneAt: this.now(browserTime) });
      }
    }
    if (data.skipped > 0) {
      if (this.calls[0]?.skipped) {
        this.calls[0] = { skipped: this.calls[0].skipped + data.skipped };
      } else {
        this.calls.unshift({ skipped: data.skipped });
      }
    }
    this.calls.unshift(...[...(data.calls ?? [])].reverse());
    this.calls.length = Math.min(this.calls.length, keptCalls);
  }

  /** The channels of a machine by number, then those of its message queues. */
  channelsOf(machine, names = new Set([machine])) {
    return [...this.channels.values()].filter((channel) => ownerOf(channel, names) === machine)
      .sort((a, b) => byName(queueOf(a, machine), queueOf(b, machine)) || a.channel - b.channel);
  }

  /** All machines by name, with the links of their gateways and with their channels. */
  plant() {
    const names = new Set([...this.machines.values()].map((machine) => machine.machine));
    for (const channel of this.channels.values()) {
      names.add(ownerOf(channel, names));
    }
    return [...names].sort(byName).map((name) => ({
      name,
      links: linksOf([...this.machines.values()].filter((machine) => machine.machine === name)),
      channels: this.channelsOf(name, names),
    }));
  }

  /** Instances by UUID, running ones first; services without a running instance come first. */
  servicesByUuid() {
    const groups = new Map();
    for (const service of this.services.values()) {
      const group = groups.get(service.uuid) ?? { uuid: service.uuid, name: '', instances: [] };
      group.instances.push(service);
      groups.set(service.uuid, group);
    }
    for (const group of groups.values()) {
      group.instances.sort((a, b) => (a.goneAt ?? 0) - (b.goneAt ?? 0) || byName(a.name ?? '', b.name ?? '')
        || byName(a.instance, b.instance));
      group.name = commonName(group.instances.map((service) => service.name ?? ''));
      group.here = group.instances.filter((service) => service.goneAt === undefined).length;
      group.level = worstOf(this.concerns.filter((concern) => concern.uuid?.toLowerCase() === group.uuid)).level;
    }
    return [...groups.values()].sort((a, b) => (b.here === 0) - (a.here === 0) || byName(a.name, b.name) || byName(a.uuid, b.uuid));
  }

  /** Name of the service of a UUID, also after its last instance; the UUID itself if that is unknown. */
  serviceName(uuid) {
    const same = [...this.services.values()].filter((service) => service.uuid === uuid?.toLowerCase());
    return same.length > 0 ? commonName(same.map((service) => service.name ?? ''))
      : [...this.channels.values(), ...this.calls].find((each) => each.service && each.uuid?.toLowerCase() === uuid?.toLowerCase())?.service ?? uuid ?? '';
  }

  #hear(serverTime, browserTime) {
    const time = milliseconds(serverTime);
    if (Number.isFinite(time)) {
      this.#offset = time - browserTime;
    }
    this.#lastHeard = browserTime;
  }

  #merge(data, browserTime) {
    this.concerns = data.concerns ?? this.concerns;
    this.acknowledged = data.acknowledged ?? this.acknowledged;
    if (data.events) {
      const changed = new Set(data.events.map((event) => event.number));
      this.events = [...data.events, ...this.events.filter((event) => !changed.has(event.number))]
        .sort((a, b) => milliseconds(b.time) - milliseconds(a.time) || b.number - a.number).slice(0, keptEvents);
    }
    for (const machine of data.machines ?? []) {
      this.machines.set(keyOf(machine.machine, machine.gateway), machine);
    }
    for (const channel of data.channels ?? []) {
      this.channels.set(keyOf(channel.machine, channel.channel), channel);
    }
    for (const service of data.services ?? []) {
      this.services.set(service.instance, service.gone ? { ...service, goneAt: milliseconds(service.gone) } : service);
    }
    for (const [id, service] of this.services) {
      if (service.goneAt !== undefined && this.now(browserTime) - service.goneAt > keptGoneMs) {
        this.services.delete(id);
      }
    }
  }

  /** Puts the calls of a snapshot above the known ones, with an entry where calls are missing between them. */
  #mergeCalls(fresh, gap) {
    const known = new Set(this.calls.map((call) => call.call).filter(Boolean));
    const unknown = fresh.filter((call) => !known.has(call.call));
    const overlap = unknown.length < fresh.length;
    if (gap !== null && this.calls.length > 0 && (gap.otherServer || !overlap)) {
      this.calls.unshift({ gap: { from: gap.from, to: gap.to } });
    }
    this.calls.unshift(...unknown);
    this.calls.length = Math.min(this.calls.length, keptCalls);
  }
}

/** The common name of instances: "square root 1", "square root 2" and "square root B" are "square root". */
function commonName(names) {
  let common = names[0];
  for (const name of names) {
    while (!name.startsWith(common)) {
      common = common.slice(0, -1).replace(/[\s\d_-]+$/, '');
    }
  }
  return common.length > 2 ? common : names[0];
}

/**
 * The load of all instances of a service: { busy, rate, errors, p50, p99 }. `busy` is the used share of their capacity over
 * the last seconds, rate is per second, errors are those of the last minute; p50 and p99 are those of the slowest, undefined without calls.
 */
export function loadOf(group) {
  const here = group.instances.filter((service) => service.goneAt === undefined);
  const sum = (value) => here.reduce((all, service) => all + (value(service) || 0), 0);
  const capacity = sum((service) => service.concurrency);
  // Short calls count by rate and duration, long ones by the number of running calls.
  const inUse = Math.max(sum((service) => (service.calls_per_second * service.p50_ms) / 1000), sum((service) => service.running * (service.p50_ms > 500 || !service.p50_ms)));
  const slowest = (name) => here.map((service) => service[name]).filter(Number.isFinite).reduce((a, b) => Math.max(a, b), -Infinity);
  const known = (value) => (Number.isFinite(value) ? value : undefined);
  return {
    busy: capacity > 0 ? Math.min(1, inUse / capacity) : undefined,
    rate: sum((service) => service.calls_per_second),
    errors: sum((service) => service.errors_last_minute),
    waiting: sum((service) => service.waiting),
    p50: known(slowest('p50_ms')),
    p99: known(slowest('p99_ms')),
  };
}

/** The load of a service in the last minute, from the lines of /api/history; undefined without them. */
export function busyOfMinute(group, lines) {
  const here = group.instances.filter((service) => service.goneAt === undefined && lines[service.instance]);
  const capacity = here.reduce((all, service) => all + (service.concurrency || 0), 0);
  const steps = 12;
  let inUse = 0;
  let known = 0;
  for (const service of here) {
    const line = lines[service.instance];
    const from = Math.max(0, line.running.length - steps);
    for (let i = from; i < line.running.length; i += 1) {
      const p50 = line.p50_ms[i];
      // Short calls count by rate and duration, long ones by the number of running calls.
      inUse += Math.min(service.concurrency, Math.max(p50 ? (line.calls_per_second[i] * p50) / 1000 : 0, !p50 || p50 > 500 ? line.running[i] ?? 0 : 0));
    }
    known = Math.max(known, line.running.length - from);
  }
  return capacity > 0 && known > 0 ? Math.min(1, inUse / known / capacity) : undefined;
}

/** Order of services: without instance, with errors, with waiting calls, then by load. */
export function byTrouble(groups) {
  const rank = (group, load) => (group.here === 0 ? 0 : load.errors > 0 ? 1 : load.waiting > 0 ? 2 : 3);
  return groups.map((group) => ({ group, load: loadOf(group) }))
    .sort((a, b) => rank(a.group, a.load) - rank(b.group, b.load) || (b.load.busy ?? 0) - (a.load.busy ?? 0)
      || b.load.rate - a.load.rate || byName(a.group.name, b.group.name));
}

/** Drops a gateway that is gone if another one has its machine: it was restarted. */
function linksOf(links) {
  const present = links.filter((link) => !link.gone);
  return present.length > 0 ? present : links;
}

/** Natural order of names: m2 before m10. */
export function byName(a, b) {
  return a.localeCompare(b, undefined, { numeric: true });
}
