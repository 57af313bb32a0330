// A server with the page of the source tree and an invented plant, for situations that are hard to
// produce with real processes: many machines, several causes at once. It sends the page's headers,
// so that its Content-Security-Policy holds here, too.
//
//   const { url, stop } = await serve(plantWith({ machines: 20, causes: 5 }));
import { readFileSync } from 'node:fs';
import { createServer } from 'node:http';
import { dirname, extname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const page = join(dirname(fileURLToPath(import.meta.url)), 'page');
const head = readFileSync(join(process.env.MILLRACE_SOURCE, 'tools/web/live/messages.cpp'), 'utf8');
/** As the server sends it: the pieces of the C++ text, put together. */
const policy = /Content-Security-Policy: ((?:[^\\]|\\(?!r))*)\\r/.exec(head.replace(/"\s*\n\s*"/g, ''))[1];
const types = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css', '.svg': 'image/svg+xml' };

export const uuids = {
  root: '560aacbf-6335-44a9-895a-8b27f3ed5e47', marker: '3d5a2f8c-9b1e-4f06-8a7d-1c2e3f405162',
  length: '11112222-3333-4444-5555-666677778888', gauge: '77aacbff-6335-44a9-895a-8b27f3ed5e47',
};

const ago = (seconds) => `${new Date(Date.now() - seconds * 1000).toISOString().slice(0, -1)}000Z`;

const instance = (id, uuid, name, pid, more = {}) => ({
  instance: id, uuid, name, description: '', version: '0.1.0', host: 'vm', pid, channels: [], delivery: 'at-least-once', concurrency: 1,
  draining: false, running: 0, waiting: 0, answered_calls: 4711, failed: 0, started: ago(900), calls_per_second: 0, errors_last_minute: 0, ...more,
});
const link = (machine, more = {}) => ({
  machine, connected: true, since: ago(4000), address: '127.0.0.1:48898/127.0.0.1.1.1', reason: '', poll_ms: 10, watch: 'pushed',
  round_trip_ms: 0.395, gateway_host: 'vm', gateway_pid: 31766, gateway_version: '0.1.0', gateway: `gateway of ${machine}`, ...more,
});
const channel = (machine, number, more = {}) => ({
  machine, channel: number, channel_state: 'idle', since: ago(30), attempt: 1, reason: '', calls: 100, link: 'up', instances: 1,
  calls_per_second: 0, ...more,
});
const busy = (rate, program) => ({
  // Its last change is always recent, however slow the host of the test is.
  uuid: uuids.root, service: 'square root', calls_per_second: rate, recent_mean_ms: 1.5, since: ago(-600),
  program: { state: 'running', name: program, since: ago(600) },
});

/** How the server says that a channel is shown. */
function viewOf(channel) {
  const { link: how, channel_state: state, since, program } = channel;
  const call = { gone: 'gateway gone', down: 'link down' }[how] ?? state;
  const level = how !== 'up' || ['unserved', 'held'].includes(state) ? 'act' : 'fine';
  const isAborted = level === 'fine' && program?.state === 'aborted';
  return { call, call_level: level, state: isAborted ? 'program aborted' : call, level: isAborted ? 'act' : level, since: isAborted ? program.since : since };
}

const catalogue = new Map([...readFileSync(join(process.env.MILLRACE_SOURCE, 'base/messages/catalogue.def'), 'utf8')
  .matchAll(/^MILLRACE_MESSAGE\((\w+), "((?:[^"\\]|\\.)*)"\)$/gm)].map(([, code, english]) => [code, english.replaceAll('\\"', '"')]));

/** A sentence of the catalogue with its values, each a text or a sentence. */
function said(code, ...values) {
  const texts = values.map((value) => value.text ?? value);
  return { code, arguments: values, text: catalogue.get(code).replace(/\{\}/g, () => texts.shift()) };
}

/** The same as the server's JSON has it, under this name. */
const sentence = (name, code, ...values) => {
  const { text } = said(code, ...values);
  return { [name]: text, [`${name}_code`]: code, [`${name}_arguments`]: values };
};
const step = (code, ...values) => sentence('text', code, ...values);
const command = (text) => step('run_command', text);
const concern = (kind, seconds, cause, parts) => ({ kind, level: 'act', who: 'engineer', since: ago(seconds), cause, ...parts });

/** Things that go wrong. */
const mishaps = {
  held: (plant) => {
    const lost = 'laser marker (pid 31802 on vm) is lost during this call, which must not run twice; an operator must answer or retry it';
    plant.services.push(instance('f', uuids.marker, 'laser marker', 31802, { gone: ago(432), delivery: 'at-most-once' }));
    plant.change('mill_2', 3, {
      channel_state: 'held', call: '5f3a9c0112d4-17', since: ago(432), uuid: uuids.marker, service: 'laser marker', request: 'part 4711', instances: 0,
      reason: lost, reason_code: 'instance_lost_held', reason_arguments: ['laser marker (pid 31802 on vm)'], program: { state: 'running', name: 'laser_mark.nc', since: ago(500) },
    });
    plant.concerns.push(concern('held', 432, 'held mill_2/3 5f3a9c0112d4-17', {
      who: 'operator', subject: 'mill_2/3', machines: ['mill_2'], channels: [{ machine: 'mill_2', channel: 3 }], uuid: uuids.marker,
      ...sentence('what', 'what_held'), ...sentence('why', 'instance_lost_held', 'laser marker (pid 31802 on vm)'),
      todo: [step('start_service_first'), step('check_machine'),
        command('millrace answer mill_2/3 RESPONSE --state N'), command('millrace retry mill_2/3')],
    }));
    plant.happened(433, 'instance ended', { uuid: uuids.marker, name: 'laser marker', host: 'vm', pid: 31802, last: true });
    plant.happened(432, 'call held', { machines: ['mill_2'], channel: 3, call: '5f3a9c0112d4-17', uuid: uuids.marker, text: lost, text_code: 'instance_lost_held', text_arguments: ['laser marker (pid 31802 on vm)'] });
  },
  unserved: (plant) => {
    plant.services.push(instance('e', uuids.length, 'tool length', 7898, { gone: ago(264) }));
    for (const [number, since] of [[3, 264], [4, 200]]) {
      plant.change('lathe_1', number, {
        channel_state: 'unserved', since: ago(since), uuid: uuids.length, service: 'tool length', request: `T${number} check`, instances: 0,
        reason_code: 'no_instance', reason_arguments: [`${uuids.length}`, 'tool length (pid 7898 on vm)'],
        reason: `no instance serves ${uuids.length}; the last one was tool length (pid 7898 on vm)`, program: { state: 'running', name: 'tool_check.nc', since: ago(300) },
      });
    }
    plant.concerns.push(concern('unserved', 264, `unserved ${uuids.length}`, {
      subject: 'lathe_1/3, lathe_1/4', machines: ['lathe_1'], channels: [3, 4].map((number) => ({ machine: 'lathe_1', channel: number })), uuid: uuids.length,
      ...sentence('what', 'what_unserved'), ...sentence('why', 'last_instance_was', 'tool length', '7898', 'vm'),
      todo: [step('start_service_again', 'tool length')],
    }));
    plant.happened(264, 'instance ended', { uuid: uuids.length, name: 'tool length', host: 'vm', pid: 7898, last: true });
  },
  aborted: (plant) => {
    plant.change('mill_2', 1, { program: { state: 'aborted', name: 'fixture_wrong.nc', error: 455, since: ago(467) } });
    plant.concerns.push(concern('program aborted', 467, 'program aborted mill_2/1', {
      who: 'operator', subject: 'mill_2/1', machines: ['mill_2'], channels: [{ machine: 'mill_2', channel: 1 }],
      ...sentence('what', 'what_program_aborted'), ...sentence('why', 'program_and_error', 'fixture_wrong.nc', '455'),
      todo: [step('check_error_then_reset')],
    }));
    plant.happened(467, 'program aborted', { machines: ['mill_2'], channel: 1, name: 'fixture_wrong.nc', error: 455 });
  },
  'link down': (plant) => {
    const reason = '10.0.0.7:48898: no connection in 2000 ms: is the host on, is a firewall between?';
    plant.concerns.push(concern('link down', 33, 'link down press_4', {
      subject: 'press_4', machines: ['press_4'], channels: plant.channelsOf('press_4'), ...sentence('what', 'what_link_down'), why: reason,
      todo: [step('check_link', '10.0.0.7:48898', 'vm')],
    }));
    plant.disconnect(['press_4'], 'down', { reason, since: ago(33) });
  },
  gone: (plant) => {
    plant.concerns.push(concern('gateway gone', 75, 'gateway gone g', {
      subject: 'press_5, press_6', machines: ['press_5', 'press_6'], channels: [...plant.channelsOf('press_5'), ...plant.channelsOf('press_6')],
      ...sentence('what', 'what_gateway_gone'), ...sentence('why', 'gateway_was', 'hall-3', '31766'),
      todo: [step('restart_gateway_with_journal', 'hall-3')],
    }));
    plant.disconnect(['press_5', 'press_6'], 'gone', { reason: 'its gateway is gone', gateway: 'one gateway', gateway_host: '', gone: true, since: ago(75) });
  },
};

/**
 * A snapshot as the server sends it; of the machines beyond the first two each has six channels. `causes` are names of
 * mishaps, or the number of the first ones.
 */
export function plantWith({ machines = 2, causes = 0 } = {}) {
  const plant = {
    machines: [link('lathe_1'), link('mill_2', { watch: 'polled' })],
    channels: [channel('lathe_1', 1, busy(1.1, 'measure_contour.nc')), channel('lathe_1', 2, busy(9.3, 'pallet_shuttle.nc')), channel('lathe_1', 3),
      channel('lathe_1', 4), channel('mill_2', 1), channel('mill_2', 2, busy(9.4, 'pallet_shuttle.nc')), channel('mill_2', 3)],
    services: [instance('a', uuids.root, 'square root A', 31768, { calls_per_second: 9.4, p50_ms: 1.5, p99_ms: 9, running: 1 }),
      instance('b', uuids.root, 'square root B', 31770, { calls_per_second: 9.3, p50_ms: 1.5, p99_ms: 9 }),
      instance('c', uuids.root, 'square root lathe', 31775, { channels: ['lathe_1'], calls_per_second: 1.1, p50_ms: 1.6, p99_ms: 9 }),
      instance('d', uuids.gauge, 'dial gauge', 31790)],
    events: [],
    concerns: [],
    channelsOf(name) {
      return this.channels.filter(({ machine }) => machine === name).map((each) => ({ machine: name, channel: each.channel }));
    },
    change(machine, number, more) {
      Object.assign(this.channels.find((each) => each.machine === machine && each.channel === number), more);
    },
    disconnect(names, how, more) {
      for (const each of this.machines.filter(({ machine }) => names.includes(machine))) {
        Object.assign(each, { connected: false, watch: 'none', ...more });
      }
      for (const each of this.channels.filter(({ machine }) => names.includes(machine))) {
        Object.assign(each, { link: how, channel_state: 'link down' });
      }
    },
    happened(seconds, kind, more) {
      this.events.push({ number: this.events.length + 1, time: ago(seconds), kind, ...more });
    },
  };
  for (let i = 3; i <= machines; i += 1) {
    plant.machines.push(link(`press_${i}`));
    plant.channels.push(...[1, 2, 3, 4, 5, 6].map((number) => channel(`press_${i}`, number)));
  }
  plant.happened(900, 'instance started', { uuid: uuids.root, name: 'square root A', host: 'vm', pid: 31768 });
  const happened = Array.isArray(causes) ? causes : Object.keys(mishaps).slice(0, causes);
  happened.forEach((name) => mishaps[name](plant));
  plant.channels.forEach((each) => Object.assign(each, { view: viewOf(each) }));
  const order = ['held', 'gateway gone', 'link down', 'unserved', 'program aborted'];
  plant.concerns.sort((a, b) => order.indexOf(a.kind) - order.indexOf(b.kind));
  return {
    about: { version: '0.1.0', host: 'vm', fabric: 'plant', domain: 151, recordings: true, actions: true, started: ago(5000), time: ago(0) },
    ...JSON.parse(JSON.stringify(plant)), acknowledged: [], calls: [],
    totals: { calls: 5000, failed: 1, calls_per_second: 20, errors_last_minute: happened.length > 0 ? 1 : 0, data_groups: 1, program_channels: 3 },
  };
}

/** Calls per second of the last minute, as /api/history tells them; and a line for each instance that is `busy`. */
export const historyOf = (served = [], busy = {}) => ({
  step_ms: 5000, end: ago(0), services: {},
  served: served.map(([id, machine, number, rate]) => ({ instance: id, machine, channel: number, calls_per_second: rate })),
  instances: Object.fromEntries(Object.entries(busy).map(([id, running]) => [id, {
    calls_per_second: [0], errors_per_second: [0], p50_ms: [null], p99_ms: [null], running: [running],
  }])),
});

/** The last minutes of the services of a snapshot, with lines for plots. */
export function minuteOf({ services }) {
  const steps = 120;
  const line = (of) => Array.from({ length: steps }, (_, i) => of(i));
  const linesOf = (service, i) => {
    const rate = service.calls_per_second;
    return {
      calls_per_second: line((at) => rate && Math.max(0, rate + Math.sin(at / 6 + i))), errors_per_second: line(() => 0),
      p50_ms: line(() => service.p50_ms ?? null), p99_ms: line((at) => (service.p99_ms ? service.p99_ms + Math.sin(at / 3) : null)),
      running: line(() => 0.2 * (rate > 5)),
    };
  };
  const here = services.filter((service) => !service.gone);
  const history = historyOf([['a', 'lathe_1', 2, 4.7], ['a', 'mill_2', 1, 0.6], ['a', 'mill_2', 2, 4.6], ['b', 'lathe_1', 2, 4.6], ['b', 'mill_2', 2, 4.7],
    ['c', 'lathe_1', 1, 1.1]]);
  history.instances = Object.fromEntries(here.map((service, i) => [service.instance, linesOf(service, i)]));
  history.services = Object.fromEntries([...new Set(here.map((service) => service.uuid))].map((uuid) => [uuid,
    linesOf({ ...here.find((service) => service.uuid === uuid), calls_per_second: here.filter((service) => service.uuid === uuid).reduce((sum, service) => sum + service.calls_per_second, 0) }, 0)]));
  return history;
}

/** Calls that have ended, as /api/calls tells them. */
export function endedCalls() {
  const kinds = [
    { machine: 'call.0badcafe', channel: 1, request: '9', response: '3', name: 'square root A', instance: 'a' },
    { machine: 'lathe_1', channel: 2, request: '2', response: '1.4142135623730951', name: 'square root A', instance: 'a' },
    { machine: 'mill_2', channel: 2, request: '1e4', response: '100', name: 'square root B', instance: 'b' },
    { machine: 'lathe_1', channel: 1, request: '-1', response: '', response_state: 2, result: 'other_state', name: 'square root lathe', instance: 'c' },
    { machine: 'mill_2', channel: 2, request: '625', response: '25', name: 'square root A', instance: 'a', attempt: 2 },
    { machine: 'mill_2', channel: 1, request: 'contour', response: 'text "contour" is no number', response_state: 99, result: 'failed', failed: true, name: 'square root B', instance: 'b' },
    { machine: 'mill_2', channel: 3, request: 'part 4710', end: 'withdrawn', result: 'withdrawn', uuid: uuids.marker, service: 'laser marker', name: 'laser marker', instance: 'f' },
  ];
  return { kept: 5000, calls: Array.from({ length: 24 }, (_, i) => ({
    call: `5f3a9c0112d4-${40 - i}`, uuid: uuids.root, service: 'square root', host: 'vm', request_state: 1, response_state: 1, attempt: 1, failed: false, result: 'answered',
    end: 'answered', duration_ms: 1.2 + (i % 5) / 3, ended: ago(2 + i * 0.37), ...kinds[(i * 7) % 17 % 7],
  })) };
}

/** Recordings, one of them being written, as /api/recordings tells them. */
export const recordings = () => ({ '/api/recordings': { recordings: [
  { name: '2026-11-27_shift_1.mcap.part', size: 8_400_000, writing: true, modified: ago(1), start: ago(7200), machines: ['lathe_1', 'mill_2'], calls: 41_200, failed: 3 },
  { name: '2026-11-26_shift_3.mcap', size: 48_900_000, modified: ago(36_000), start: ago(64_800), end: ago(36_000), machines: ['lathe_1', 'mill_2'], calls: 204_117, failed: 0 },
  { name: 'tool_check.mcap', size: 640_000, modified: ago(90_000), start: ago(91_800), end: ago(90_000), machines: ['lathe_1'], calls: 1830, failed: 12 },
] } });

/** The timeline of the call that is held in the first mishap, as /api/calls/CALL tells it. */
export function heldTimeline() {
  const step = (seconds, hop, more = {}) => ({ time: ago(seconds), hop, attempt: 0, by_service: false, ...more });
  return {
    call: '5f3a9c0112d4-17', machine: 'mill_2', channel: 3, uuid: uuids.marker, clock_difference_ms: 0, steps: [
      step(433, 'seen by the gateway', { text: 'part 4711', state: 1 }),
      step(432.998, 'dispatched', { attempt: 1, instance: 'f', detail: 'laser marker (pid 31802 on vm)' }),
      step(432.996, 'handler started', { attempt: 1, instance: 'f', by_service: true }),
      step(432, 'instance lost', { attempt: 1, instance: 'f' }),
      step(432, 'held for an operator', { attempt: 1 }),
      step(3, 'dispatched', { attempt: 2, instance: 'f', detail: 'laser marker (pid 31802 on vm)' }),
      step(2.9, 'handler started', { attempt: 2, instance: 'f', by_service: true }),
      step(2.2, 'answered by the instance', { attempt: 2, instance: 'f', by_service: true, text: 'ok', state: 1 }),
      step(2.1, 'reply at the gateway', { attempt: 2, instance: 'f', text: 'ok', state: 1 }),
      step(2, 'written back', { text: 'ok', state: 1 }),
    ],
  };
}

/** A recorded call with each kind of detail, as /api/recordings/NAME/calls/CALL tells it. */
export function recordedTimeline() {
  const timeline = heldTimeline();
  const marker = 'laser marker (pid 31802 on vm)';
  const details = {
    'instance lost': { code: 'instance_lost', arguments: [marker], text: `${marker} is lost; the call goes to another instance` },
    'held for an operator': { code: 'instance_lost_held', arguments: [marker], text: `${marker} is lost during this call` },
    'reply at the gateway': { code: 'answered_by', arguments: ['anna@hall-3'], text: 'answered by anna@hall-3' },
  };
  const detailed = ({ code, arguments: values, text }) => ({ detail: text, detail_code: code, detail_arguments: values });
  timeline.steps = timeline.steps.map((step) => ({ ...step, ...(details[step.hop] && detailed(details[step.hop])) }));
  const tooLong = { code: 'response_too_long', arguments: ['900', '127'], text: 'has 900 bytes, at most 127 fit' };
  const more = [['declined by the instance', { code: 'no_room', arguments: ['4'], text: 'it runs at most 4 calls at once' }],
    ['late reply dropped', { code: 'deadline', arguments: ['30 s'], text: 'no response within 30 s; the NC program goes on waiting' }],
    ['reply refused', { code: 'refused_with_state', arguments: [{ code: 'answer_of_service', arguments: [tooLong], text: 'the service\'s answer' }, '3'], text: 'the NC program gets state 3' }],
    ['withdrawn by the program', { code: 'program_withdrew', arguments: [], text: 'the NC program withdrew the request' }]];
  timeline.steps.push(...more.map(([hop, detail]) => ({ time: ago(1), hop, attempt: 2, by_service: false, instance: 'f', ...detailed(detail) })));
  return timeline;
}

/** Findings of different kinds, as /api/doctor tells them. */
export const diagnoses = () => ({
  healthy: false, fabric: 'plant', domain: 151, interface: 'eth0', multicast: true, time: ago(1), clocks: [{ host: 'hall-3', asked: 'sq', ahead_ms: 1.2, error_ms: 0.1 }],
  programs: [{ name: 'sq', host: 'vm', pid: '7', addresses: 'udp/10.0.0.5:7410', fabrics: ['plant'], gateway: false, heard: true, serves: [uuids.root], self: false }],
  diagnoses: [
    ['problem', said('about', 'mill_2/3', said('about', said('what_held'), said('instance_lost_held', 'sq (pid 7 on vm)'))),
      step('start_service_first'), step('check_machine'), command('millrace retry mill_2/3')],
    ['problem', said('about', said('process_on_host', 'gateway', 'vm', '8'), said('about', said('what_journal'), said('journal_unwritable', 'disk full'))), step('free_space')],
    ['problem', said('writer_does_not_match', 'millrace/v5/event', said('process_on_host', 'sq', 'vm', '7'), said('qos_differs', 'durability', 'volatile', 'transient local')), step('give_it_qos')],
    ['warning', said('gateway_version_differs', 'lathe_1', '0.0.9', '0.1.0'), step('install_one_version')],
    ['warning', said('plain_ads_readable', 'lathe_1'), step('configure_secure', 'lathe_1', 'vm')],
    ['warning', said('clock_ahead', 'hall-3', '152 ms', '1.00 ms', 'sq'), step('synchronise_for_recordings')],
    ['fine', said('programs_on_hosts', '3', '2')], ['fine', said('interface_up', 'eth0', '10.0.0.5')], ['fine', said('connected_plain_ads', 'lathe_1', 'vm')],
  ].map(([severity, { code, arguments: values }, ...todo]) => ({ severity, ...sentence('what', code, ...values), todo })),
});

/** Ten minutes of values of lathe_1 and its NC programs, by path of the API. */
export function dataOfLathe() {
  const seconds = Array.from({ length: 600 }, (_, i) => 600 - i);
  const runs = [[500, 420, 'ended'], [300, 180, 'ended'], [120, 40, 'aborted']];
  const isRunning = (second) => runs.some(([from, to]) => second <= from && second > to);
  const state = (second) => (isRunning(second) ? 4 : second <= 40 ? 6 : 2);
  const variables = [['V.A.ACT_POS.X', 'REAL64', (second) => (isRunning(second) ? 6 + 3 * Math.sin(second / 7) + Math.sin(second / 2) : 6)],
    ['state', 'UNS32', state], ['V.E.READY', 'BOOLEAN', (second) => Number(!isRunning(second))]];
  const good = { quality: 'good', at: ago(0) };
  const valueOf = (type, value) => (type === 'BOOLEAN' ? value === 1 : value);
  return {
    '/api/data/machines': ['lathe_1'],
    '/api/data': [{ machine: 'lathe_1', channel: 1, group: 'fast', wanted_ms: 100, period_ms: 100,
      values: variables.map(([name, type, of]) => ({ name, type, value: valueOf(type, of(1)), ...good })) }],
    '/api/data/history': { series: variables.map(([name, type, of]) => ({
      variable: `1/fast/${name}`, whole: true, type, value: valueOf(type, of(1)), ...good,
      times: seconds.map((second) => Date.now() - second * 1000), values: seconds.map(of),
    })) },
    '/api/programs/runs': { runs: runs.map(([from, to, ended], i) => ({
      channel: 1, program: `part_${17 + (i >> 1)}.nc`, state: ended, started: ago(from), ended: ago(to), duration_s: from - to, ...(ended === 'aborted' ? { error: 455 } : {}),
    })) },
  };
}

/** Serves the page with this snapshot to a user who is logged in. */
export async function serve(snapshot, history = historyOf(), more = {}) {
  const open = new Set();
  const json = {
    '/api/session': { actions: true, user: 'anna', token: 'x', may: ['answer', 'retry', 'drain', 'acknowledge', 'forget'] },
    '/api/history': history,
    '/api/calls': { calls: [], kept: 0 },
    ...more,
  };
  const server = createServer((request, response) => {
    const { pathname } = new URL(request.url, 'http://localhost');
    if (pathname === '/api/live') {
      response.writeHead(200, { 'Content-Type': 'text/event-stream' });
      response.write(`event: snapshot\ndata: ${JSON.stringify({ ...snapshot, about: { ...snapshot.about, time: ago(0) } })}\n\n`);
      const beat = setInterval(() => response.write(`event: changes\ndata: ${JSON.stringify({ time: ago(0) })}\n\n`), 1000);
      open.add(response);
      request.on('close', () => clearInterval(beat));
    } else if (pathname in json) {
      response.writeHead(200, { 'Content-Type': 'application/json' }).end(JSON.stringify(json[pathname]));
    } else {
      const file = join(page, pathname === '/' ? 'index.html' : pathname);
      response.writeHead(200, { 'Content-Type': types[extname(file)], 'Content-Security-Policy': policy }).end(readFileSync(file));
    }
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  return {
    url: `http://127.0.0.1:${server.address().port}`,
    /** Sends these changes to all pages. */
    change(changes) {
      open.forEach((response) => response.write(`event: changes\ndata: ${JSON.stringify({ time: ago(0), ...changes })}\n\n`));
    },
    async stop() {
      open.forEach((response) => response.end());
      await new Promise((resolve) => { server.close(resolve); server.closeAllConnections(); });
    },
  };
}
