// The page's functions that draw nothing: the model, open problems, the time axis, and complete
// texts in both languages.
import assert from 'node:assert/strict';
import { readdirSync, readFileSync } from 'node:fs';
import { test } from 'node:test';
import { acknowledgeKey, acknowledgementOf, assess, callStateOf, concernKey, concernName, nextConcernIn, otherChannels, stateOf } from './page/attention.js';
import { adviceOf, matrixOf, mayServe, mostColumns } from './page/capacity.js';
import { isNumber, Line, pathOf, placeOf, qualityOf, rangeOf, ticks, timeTicks, variablesOf } from './page/lines.js';
import { busyOfMinute, byTrouble, keptCalls, loadOf, Model, toolOf } from './page/model.js';
import german from './page/texts/de.js';
import { findings } from './page/texts/de_findings.js';
import { messages } from './page/texts/de_messages.js';
import { reasons } from './page/texts/de_reasons.js';
import english from './page/texts/en.js';
import { messages as englishMessages } from './page/texts/en_messages.js';
import { messageOf } from './page/texts/sentences.js';
import { age, duration, fineClock, milliseconds } from './page/time.js';
import { layOut, marksOf, scaleOf } from './page/waterfall.js';

const noon = Date.UTC(2026, 2, 1, 12);
const iso = (ms) => new Date(ms).toISOString();

/** The keys of nested texts with what each is: "plant.well text", "plant.needs 1". */
function keysOf(texts, prefix = '') {
  return Object.entries(texts).flatMap(([key, value]) => {
    if (typeof value === 'object') {
      return keysOf(value, `${prefix}${key}.`);
    }
    return [`${prefix}${key} ${typeof value === 'function' ? value.length : 'text'}`];
  }).sort();
}

test('German and English have the same texts with the same values in them', () => {
  assert.deepEqual(keysOf(german), keysOf(english));
});

test('no text is empty, and each state has a word of its own', () => {
  for (const texts of [english, german]) {
    const words = Object.values(texts.states);
    assert.equal(new Set(words).size, words.length);
    assert.ok(words.every((word) => word.trim()));
  }
});

test('times keep their microseconds', () => {
  const at = milliseconds('2026-03-01T07:00:00.123456Z');
  assert.ok(Math.abs(at - Date.UTC(2026, 2, 1, 7) - 123.456) < 1e-3);
  assert.equal(fineClock(at).slice(-10), '00.123456'.padStart(10, ':'));
  assert.ok(Number.isNaN(milliseconds(undefined)));
  assert.ok(Number.isNaN(milliseconds('<script>')));
});

test('durations have three digits and a unit', () => {
  assert.deepEqual([0.395, 1.234, 45.67, 45_600, 185_000, 7_800_000].map(duration),
    ['395 µs', '1.23 ms', '45.7 ms', '45.6 s', '3 min 05 s', '2 h 10 min']);
  assert.equal(age(-5000), '0 s', 'a clock that is ahead');
});

const about = (started = noon, time = noon) => ({ started: iso(started), time: iso(time), fabric: 'test' });
const call = (number) => ({ call: `a-${number}`, machine: 'cnc', channel: 1, ended: iso(noon + number) });

test('changes replace what they name and leave the rest', () => {
  const sut = new Model();
  sut.takeSnapshot({ about: about(), channels: [{ machine: 'cnc', channel: 1, calls: 1 }, { machine: 'cnc', channel: 2, calls: 1 }] }, 0);
  sut.takeChanges({ time: iso(noon), channels: [{ machine: 'cnc', channel: 2, calls: 5 }] }, 0);
  assert.deepEqual(sut.channelsOf('cnc').map((channel) => channel.calls), [1, 5]);
});

test('a call of a tool has the name of its command, and a service its name after its last instance', () => {
  assert.deepEqual(['call.0badcafe', 'replay.0badcafe', 'call', 'cnc.ALARMS'].map((machine) => toolOf({ machine })), ['millrace call', 'millrace replay', '', '']);
  const sut = new Model();
  sut.takeSnapshot({ about: about(), calls: [{ call: 'a-1', uuid: 'B1', service: 'square root' }] }, 0);
  assert.deepEqual([sut.serviceName('b1'), sut.serviceName('c2')], ['square root', 'c2']);
});

test('the server\'s clock counts, not the browser\'s', () => {
  const sut = new Model();
  sut.takeSnapshot({ about: about() }, noon - 3_600_000);
  assert.equal(sut.now(noon - 3_600_000 + 500), noon + 500);
});

test('while the connection is lost the time of the page stops', () => {
  const sut = new Model();
  sut.takeSnapshot({ about: about() }, 1000);
  sut.lose(9000);
  assert.equal(sut.now(60_000), noon);
  assert.ok(sut.isLost);
});

test('a list of calls shows what is missing', () => {
  const sut = new Model();
  sut.takeSnapshot({ about: about(), calls: [call(1)] }, 0);
  sut.takeChanges({ time: iso(noon), calls: [call(2), call(3)], skipped: 40 }, 0);
  assert.deepEqual(sut.calls.map((row) => row.call ?? row.skipped), ['a-3', 'a-2', 40, 'a-1']);
});

test('the list has a row for a time without data unless all its calls are there', () => {
  const sut = new Model();
  sut.takeSnapshot({ about: about(), calls: [call(1)] }, 0);
  sut.lose(1000);
  sut.takeSnapshot({ about: about(), calls: [call(2), call(1)] }, 5000);
  assert.deepEqual(sut.calls.map((row) => row.call), ['a-2', 'a-1']);
  sut.lose(6000);
  sut.takeSnapshot({ about: about(), calls: [call(9), call(8)] }, 9000);
  assert.deepEqual(sut.calls.map((row) => row.call ?? row.gap), ['a-9', 'a-8', { from: 5000, to: 9000 }, 'a-2', 'a-1']);
});

test('another server is distinguished from the same one', () => {
  const sut = new Model();
  sut.takeSnapshot({ about: about() }, 0);
  sut.lose(1000);
  sut.takeSnapshot({ about: about(noon + 1) }, 2000);
  assert.deepEqual(sut.gap, { from: 0, to: 2000, otherServer: true });
});

test('the list of calls is bounded', () => {
  const sut = new Model();
  sut.takeSnapshot({ about: about() }, 0);
  for (let i = 0; i < keptCalls; i += 1) {
    sut.takeChanges({ time: iso(noon), calls: [call(2 * i), call(2 * i + 1)], skipped: 1 }, 0);
  }
  assert.equal(sut.calls.length, keptCalls);
});

test('an instance that is gone stays for a while, and its service comes first', () => {
  const sut = new Model();
  sut.takeSnapshot({ about: about(), services: [{ instance: '1', uuid: 'u', name: 'a' }, { instance: '2', uuid: 'v', name: 'b' }] }, 0);
  sut.takeChanges({ time: iso(noon), gone: { services: ['2'] } }, 0);
  assert.deepEqual(sut.servicesByUuid().map((group) => [group.name, group.here]), [['b', 0], ['a', 1]]);
  sut.takeChanges({ time: iso(noon + 3_600_000) }, 3_600_000);
  assert.deepEqual(sut.servicesByUuid().map((group) => group.name), ['a']);
});

test('an instance that was gone before the page was opened is known as gone', () => {
  const sut = new Model();
  sut.takeSnapshot({ about: about(), services: [{ instance: '1', uuid: 'u', name: 'a', gone: iso(noon - 60_000) }] }, 0);
  assert.deepEqual(sut.servicesByUuid().map((group) => [group.name, group.here, group.instances[0].goneAt]), [['a', 0, noon - 60_000]]);
});

const machine = (channels, links = [{ connected: true, gateway_host: 'here' }]) => ({
  name: 'cnc', links, channels: channels.map((channel, i) => ({ machine: 'cnc', channel: i + 1, link: 'up', since: iso(noon), ...channel })),
});
const kinds = (plant, after) => assess(plant, noon + after).concerns.map((concern) => [concernName(concern), concern.kind, concern.level]);

test('a message queue is shown with its machine, the call of a command by itself', () => {
  const sut = new Model();
  const channelOf = (owner, number) => ({ machine: owner, channel: number, channel_state: 'idle' });
  sut.takeSnapshot({
    about: about(), machines: [{ machine: 'cnc', gateway: 'g' }],
    channels: [channelOf('cnc.ALARMS', 1), channelOf('cnc', 2), channelOf('cnc', 1), channelOf('call.5f3a', 1)],
  }, 0);
  assert.deepEqual(sut.plant().map(({ name, channels }) => [name, channels.map((each) => `${each.machine}/${each.channel}`)]),
    [['call.5f3a', ['call.5f3a/1']], ['cnc', ['cnc/1', 'cnc/2', 'cnc.ALARMS/1']]]);
});

test('channels that need attention come before those to be watched', () => {
  const plant = [machine([{ channel_state: 'waiting' }, { channel_state: 'unserved' }, { channel_state: 'idle' }, { channel_state: 'held' }])];
  assert.deepEqual(kinds(plant, 10_000), [['cnc/4', 'held', 'person'], ['cnc/2', 'unserved', 'person'], ['cnc/1', 'waiting', 'look']]);
});

test('a missing service is a concern after 1 s, one that no gateway has seen after 2 s', () => {
  const after = (code, ms) => assess([machine([{ channel_state: 'unserved', reason_code: code, since: iso(noon) }])], noon + ms).level;
  assert.deepEqual([900, 1100].map((ms) => after('no_instance', ms)), ['fine', 'person']);
  assert.deepEqual([1100, 1900, 2100].map((ms) => after('unknown_uuid_near', ms)), ['fine', 'fine', 'person']);
  const plant = [machine([{ channel_state: 'idle', since: iso(noon) }, { channel_state: 'unserved', reason_code: 'unknown_uuid', since: iso(noon) },
    { channel_state: 'waiting', instances: 0, reason_code: 'instance_lost', since: iso(noon + 500) }])];
  assert.deepEqual([0, 600, 1600, 2600].map((ms) => nextConcernIn(plant, noon + ms)), [1500, 900, 400, Infinity]);
});

test('a call that waits long needs attention, one that waits a moment does not', () => {
  const plant = [machine([{ channel_state: 'waiting' }])];
  assert.deepEqual([1000, 10_000, 70_000].map((after) => assess(plant, noon + after).level), ['fine', 'look', 'person']);
});

test('a call that runs beyond its time is to be watched', () => {
  const channel = { channel_state: 'running', link: 'up', reason_code: 'deadline', reason: 'no response within 30 s; the NC program goes on waiting' };
  assert.equal(stateOf(channel), 'stuck');
  assert.equal(stateOf({ ...channel, reason_code: undefined, reason: '' }), 'running');
});

test('an aborted NC program needs attention, one on hold is to be watched, and a call that needs an operator comes first', () => {
  const aborted = { state: 'aborted', name: 'good.nc', error: 455, since: iso(noon - 5000) };
  const plant = [machine([{ channel_state: 'idle', program: aborted }, { channel_state: 'idle', program: { ...aborted, state: 'on hold' } },
    { channel_state: 'unserved', program: aborted }, { channel_state: 'running', program: { ...aborted, state: 'running' } }])];
  assert.deepEqual(kinds(plant, 10_000), [['cnc/3', 'unserved', 'person'], ['cnc/1', 'aborted', 'person'], ['cnc/2', 'stopped', 'look']]);
  assert.equal(assess(plant, noon).concerns.find(({ kind }) => kind === 'aborted').since, noon - 5000);
  assert.deepEqual(plant[0].channels.map(callStateOf), ['idle', 'idle', 'unserved', 'running']);
});

test('a call that waits while no instance is there has no service; one whose gateway takes no calls has a full disk', () => {
  assert.equal(stateOf({ channel_state: 'waiting', link: 'up', instances: 0 }), 'unserved');
  assert.equal(stateOf({ channel_state: 'waiting', link: 'up', instances: 1 }), 'waiting');
  const left = { channel_state: 'unserved', journal: 'the journal cannot be written' };
  const plant = [machine([left, left], [{ connected: true, gateway_host: 'here', gateway: 'g' }])];
  const alarm = { responder: 'g', kind: 'journal', subject: '', level: 'problem', program: 'gateway', host: 'here', since: iso(noon), text: left.journal };
  const { concerns, counts } = assess(plant, noon + 10_000, [alarm]);
  assert.deepEqual(concerns.map((concern) => [concernName(concern), concern.kind, concern.reason]), [['cnc', 'journal', left.journal]]);
  assert.deepEqual([counts.person, counts.programs], [2, 0]);
});

test('a link that is down is one concern with all its channels, since the link went', () => {
  const links = [{ connected: false, since: iso(noon - 5000), reason: 'refused', gateway_host: 'here' }];
  const plant = [machine([{ channel_state: 'link down' }, { channel_state: 'link down' }], links)];
  const { concerns, counts } = assess(plant, noon);
  assert.equal(concerns.length, 1);
  assert.equal(concerns[0].since, noon - 5000);
  assert.equal(concerns[0].reason, 'refused');
  assert.equal(counts.person, 2);
});

test('a gateway that is gone is named with its host and process', () => {
  const links = [{ connected: false, since: iso(noon - 5000), reason: 'its gateway is gone', gone: true, last_gateway_host: 'hall', last_gateway_pid: 4711, last_gateway_journal: 'none' }];
  const [concern] = assess([machine([{ link: 'gone', channel_state: 'link down' }], links)], noon).concerns;
  assert.deepEqual([concern.kind, concern.reason, concern.gone], ['gone', '', { host: 'hall', pid: 4711, journal: 'none' }]);
  assert.deepEqual(assess([machine([], links)], noon).concerns[0].gone, { host: 'hall', pid: 4711, journal: 'none' });
  assert.match(english.plant.restartGateway('hall', 'none'), /may run twice or be lost/);
  assert.match(english.plant.restartGateway('hall', 'kept'), /not lost/);
  assert.equal(english.plant.restartGateway('hall', 'not known'), 'Restart the gateway on hall.');
});

test('reasons of a gateway are in German where the page has the sentence', () => {
  assert.equal(german.reason('no service has the UUID 560a; did you mean 560b, one character differs'),
    'Kein Dienst hat die UUID 560a. Ist 560b gemeint? (ein Zeichen ist anders)');
  assert.equal(german.reason('sq1 (pid 7 on hall) is lost during this call, which must not run twice; an operator must answer or retry it'),
    'sq1 (Prozess 7 auf hall) ist während dieses Aufrufs ausgefallen, der nicht zweimal laufen darf.');
  assert.equal(german.reason('no service has the UUID 560; did you mean 560b, one character is missing; it is malformed: 3 characters, a UUID has 36'),
    'Kein Dienst hat die UUID 560. Ist 560b gemeint? (ein Zeichen fehlt) Sie ist keine gültige UUID: 3 Zeichen, eine UUID hat 36.');
  assert.equal(german.reason('connection refused'), '');
  assert.equal(german.reason('press has no connection: 10.0.0.7:48898: no connection in 2000 ms: is the host on, is a firewall between?'),
    'press hat keine Verbindung: 10.0.0.7:48898: keine Verbindung in 2000 ms. Ist der Rechner eingeschaltet? Blockiert eine Firewall?');
  assert.equal(german.reason('on this fabric: 1 other program on 2 hosts'), 'In dieser Fabric: 1 weiterer Prozess auf 2 Rechnern.');
  const empty = { code: 'answer_of_service', arguments: [{ code: 'response_empty', arguments: [] }] };
  assert.equal(german.reason({ code: 'refused_with_state', arguments: [empty, '3'] }),
    'Die Antwort des Dienstes ist leer; ein NC-Programm, das auf RESPONSE wartet, läuft damit nicht weiter. Das NC-Programm erhält Zustand 3.');
  assert.equal(english.reason('all 3 instances are busy'), '');
  assert.equal(english.reason({ code: 'instance_lost_held', arguments: ['sq1 (pid 7 on hall)'] }), 'sq1 (hall, pid 7) exited during this call, which may run only once.');
});

test('a sentence with a code is said with its arguments, which may be sentences, and one of a later version as it comes', () => {
  const inner = { code: 'unknown_uuid_near', arguments: ['560a', '560b', { code: 'one_character_differs', arguments: [], text: 'one character differs' }], text: 'in English' };
  const wanted = 'Kein Dienst hat die UUID 560a. Ist 560b gemeint? (ein Zeichen ist anders)';
  assert.equal(german.reason(inner), wanted);
  assert.equal(german.reason({ code: 'and_also', arguments: [inner, 'connection refused'], text: '' }), `${wanted} connection refused`);
  assert.equal(german.reason({ code: 'of_tomorrow', arguments: [], text: 'in English' }), '');
  assert.equal(german.reason({ code: 'instances_busy', text: 'all 3 instances are busy' }), 'Alle  Instanzen sind belegt.');
  assert.deepEqual(messageOf({ reason: 'text', reason_code: 'declined', reason_arguments: ['a'] }, 'reason'), { text: 'text', code: 'declined', arguments: ['a'] });
  assert.equal(messageOf({ reason: 'text' }, 'reason'), 'text');
  assert.equal(messageOf({}, 'reason'), '');
});

test('each sentence with a code is in German with all of its values, and no other', () => {
  const source = readFileSync(`${process.env.MILLRACE_SOURCE}/base/messages/catalogue.def`, 'utf8');
  const rows = [...source.matchAll(/^MILLRACE_MESSAGE\((\w+), "((?:[^"\\]|\\.)*)"\)$/gm)].map(([, code, sentence]) => [code, sentence.split('{}').length - 1]);
  assert.equal(rows.length, source.match(/^MILLRACE_MESSAGE/gm).length);
  assert.deepEqual(Object.keys(messages).sort(), rows.map(([code]) => code).sort());
  for (const [code, places] of rows) {
    const placesOf = (text) => [...new Set([...text.matchAll(/\{(\d)\}/g)].map(([, number]) => Number(number)))].sort();
    assert.deepEqual(placesOf(messages[code]), [...Array(places).keys()], code);
    assert.ok(placesOf(englishMessages[code] ?? '').every((place) => place < places), code);
  }
  assert.deepEqual(Object.keys(englishMessages).filter((code) => !messages[code]), []);
});

test('a plot has round marks, room around its values, and gaps where they are unknown', () => {
  assert.deepEqual(ticks(-0.3, 6.7, 4), [0, 2, 4, 6]);
  assert.deepEqual(timeTicks(noon, noon + 300_000, 5).map((time) => time - noon), [0, 60_000, 120_000, 180_000, 240_000, 300_000]);
  assert.ok(timeTicks(noon, noon + 86_400_000, 8).length > 2);
  assert.deepEqual([rangeOf([null, 5, 15], false), rangeOf([null, 5, 10], true), rangeOf([7], false), rangeOf([null], true)], [[4, 16], [0, 11], [6.3, 7.7], [0, 0.1]]);
  const [x, y] = [(i) => 10 * i, (value) => value];
  assert.equal(pathOf([1, 2, null, 3, undefined], x, y), 'M0.00 1.00h0L10.00 2.00M30.00 3.00h0');
  assert.equal(pathOf([1, 2], x, y, true), 'M0.00 1.00h0H10.00V2.00');
});

test('a gateway that is gone is one cause with all its machines, as long as the first of them', () => {
  const gone = (name, since) => ({
    ...machine([{ link: 'gone', channel_state: 'link down' }, { link: 'gone', channel_state: 'link down' }],
      [{ connected: false, since: iso(since), gateway: 'g', gone: true, last_gateway_host: 'hall', last_gateway_pid: 4711 }]), name,
  });
  const { concerns, counts } = assess([gone('lathe', noon - 4000), gone('mill', noon - 5000), machine([], [{ connected: false, gateway: 'h', since: iso(noon) }])], noon);
  assert.deepEqual(concerns.map((concern) => [concernName(concern), concern.since, concern.channels.length]), [['lathe, mill', noon - 5000, 4], ['cnc', noon, 0]]);
  assert.deepEqual([counts.causes, counts.person, counts.machines], [2, 4, 1]);
});

test('a service without an instance is one cause for all channels that wait for it, named by the one that waits longest', () => {
  const waits = (uuid, since) => ({ channel_state: 'unserved', uuid, since: iso(noon - since) });
  const { concerns } = assess([machine([waits('u', 5000), waits('U', 9000), waits('v', 4000)])], noon);
  assert.deepEqual(concerns.map((concern) => [concernName(concern), otherChannels(concern)]), [['cnc/2', ['cnc/1']], ['cnc/3', []]]);
  assert.equal(new Set(concerns.map(concernKey)).size, 2);
});

test('an acknowledged cause keeps its user until it is over, and the next one has none', () => {
  const concernSince = (since, more = {}) => ({ cause: 'unserved u', kind: 'unserved', level: 'person', channels: [{ call: 'a-1' }], since, ...more });
  const taken = { cause: acknowledgeKey(concernSince(noon)), by: 'anna', since: String(noon), note: '', time: iso(noon + 5000) };
  assert.equal(acknowledgementOf(concernSince(noon), [taken])?.by, 'anna');
  assert.equal(acknowledgementOf(concernSince(noon, { level: 'look' }), [taken])?.by, 'anna');
  assert.equal(acknowledgementOf(concernSince(noon + 9000), [taken]), null);
  // The gateway's clock is an hour ahead.
  assert.equal(acknowledgementOf(concernSince(noon + 3_600_000), [{ ...taken, since: String(noon + 3_600_000) }])?.by, 'anna');
  assert.equal(acknowledgementOf(concernSince(noon, { cause: 'gone g' }), [taken]), null);
  const held = (call) => concernSince(noon, { kind: 'held', channels: [{ call }] });
  assert.notEqual(acknowledgeKey(held('a-1')), acknowledgeKey(held('a-2')));
});

test('each blocked call is a cause of its own', () => {
  const held = { channel_state: 'held', uuid: 'u' };
  assert.equal(assess([machine([{ ...held, call: 'a-1' }, { ...held, call: 'a-2' }])], noon).counts.causes, 2);
});

test('events come the newest first, and one that has changed takes its own place', () => {
  const sut = new Model();
  const event = (number, ms, more = {}) => ({ number, kind: 'gateway gone', time: iso(noon + ms), ...more });
  sut.takeSnapshot({ about: about(), events: [event(2, 20), event(1, 10)] }, 0);
  sut.takeChanges({ time: iso(noon), events: [event(3, 15), event(2, 20, { machines: ['a', 'b'] })] }, 0);
  assert.deepEqual(sut.events.map(({ number, machines }) => [number, machines?.length]), [[2, 2], [3, undefined], [1, undefined]]);
  sut.takeSnapshot({ about: about(), events: [] }, 0);
  assert.deepEqual(sut.events, []);
});

test('each kind of event has a sentence in both languages', () => {
  const source = readFileSync(`${process.env.MILLRACE_SOURCE}/tools/web/plant/event_book.cpp`, 'utf8');
  const kinds = new Set([...source.matchAll(/"((?:instance|gateway|link|program|call|problem) [a-z]+|problem)"/g)].map(([, kind]) => kind));
  assert.ok(kinds.size >= 10, [...kinds].join());
  for (const kind of kinds) {
    for (const texts of [english, german]) {
      assert.match(texts.events[kind]({ name: 'n', where: 'w', machines: 'm', channel: 'm/1', service: 's', text: 't' }), /[nm]/, kind);
    }
  }
});

const instance = (more) => ({ instance: '1', uuid: 'u', name: 'a', concurrency: 1, running: 0, waiting: 0, calls_per_second: 0, errors_per_second: 0, ...more });

test('a service is busy by what its calls take, short ones and long ones', () => {
  const group = (...instances) => ({ instances });
  assert.equal(loadOf(group(instance({ calls_per_second: 20, p50_ms: 10 }), instance({}))).busy, 0.1);
  assert.equal(loadOf(group(instance({ running: 1 }), instance({}))).busy, 0.5);
  assert.equal(loadOf(group(instance({ calls_per_second: 500, p50_ms: 10 }))).busy, 1, 'calls that wait are no more than all of it');
  assert.equal(loadOf(group(instance({ goneAt: noon, running: 1 }))).busy, undefined);
  assert.deepEqual([loadOf(group(instance({}))).p50, loadOf(group(instance({ p50_ms: 1 }), instance({ p50_ms: 3 }))).p50], [undefined, 3]);
  const line = (n, rate, p50, running) => ({ calls_per_second: Array(n).fill(rate), p50_ms: Array(n).fill(p50), running: Array(n).fill(running) });
  assert.equal(busyOfMinute(group(instance({})), { 1: line(20, 25, 10, 1) }), 0.25);
  assert.equal(busyOfMinute(group(instance({})), { 1: line(4, 0, null, 1) }), 1);
  assert.equal(busyOfMinute(group(instance({})), {}), undefined);
});

const rootOf = (id, more = {}) => ({ instance: id, uuid: 'u', concurrency: 1, channels: [], ...more });
const groupOf = (...instances) => ({ uuid: 'u', instances });
const servedBy = (instance, machine, channel, rate) => ({ instance, machine, channel, calls_per_second: rate });

test('an instance may serve the channels that it names, and all if it names none', () => {
  const may = (channels, machine, channel) => mayServe({ channels }, { machine, channel });
  assert.deepEqual([may([], 'cnc', 1), may(['cnc/1'], 'cnc', 1), may(['cnc/*'], 'cnc', 2), may(['*/2'], 'press', 2)], [true, true, true, true]);
  assert.deepEqual([may(['cnc/1'], 'cnc', 2), may(['cnc/*'], 'press', 1), may(['*/2'], 'press', 1)], [false, false, false]);
});

test('the matrix has a column for each channel that is served or calls, and nothing where an instance may not serve it', () => {
  const group = groupOf(rootOf('a'), rootOf('b', { channels: ['m10/*'] }), rootOf('c', { goneAt: 1 }));
  const channels = [{ machine: 'm2', channel: 1, uuid: 'U', channel_state: 'waiting' }, { machine: 'm2', channel: 2, uuid: 'u', channel_state: 'idle' }];
  const { columns, rows, left } = matrixOf(group, channels, [servedBy('a', 'm10', 3, 2), servedBy('other', 'm3', 1, 9)]);
  assert.deepEqual(columns.map(({ machine, channel }) => `${machine}/${channel}`), ['m2/1', 'm10/3']);
  assert.deepEqual(rows.map(({ service, cells }) => [service.instance, ...cells]), [['a', 0, 2], ['b', null, 0]]);
  assert.equal(left, 0);
});

test('where there are too many channels a column is a machine, and the rest is counted', () => {
  const served = Array.from({ length: 30 }, (_, i) => servedBy('a', `m${Math.floor(i / 2)}`, 1 + (i % 2), 1));
  const { columns, rows, left } = matrixOf(groupOf(rootOf('a')), [], served);
  assert.equal(columns.length, mostColumns);
  assert.deepEqual([columns[0].machine, columns[0].channel, rows[0].cells[0], left], ['m0', undefined, 2, 3]);
});

test('one more instance helps where calls wait or all are busy, unless each channel that calls has one', () => {
  const kindOf = (busy, callers, channels = [], ...instances) => adviceOf(groupOf(...instances), channels,
    Array.from({ length: callers }, (_, i) => servedBy('a', 'cnc', i + 1, 1)), busy, noon).kind;
  const waits = (ms) => ({ machine: 'cnc', channel: 1, uuid: 'u', channel_state: 'waiting', since: iso(noon - ms) });
  assert.equal(kindOf(0.9, 3, [], rootOf('a')), 'busy');
  assert.equal(kindOf(0.6, 3, [], rootOf('a')), 'peaks');
  assert.equal(kindOf(0.1, 3, [], rootOf('a')), 'enough');
  assert.equal(kindOf(0.9, 2, [], rootOf('a'), rootOf('b')), 'each');
  assert.equal(kindOf(0.9, 2, [], rootOf('a'), rootOf('b', { draining: true })), 'busy', 'one that drains takes no call');
  assert.equal(kindOf(0.1, 1, [waits(3000)], rootOf('a')), 'waiting');
  assert.equal(kindOf(0.1, 1, [waits(10)], rootOf('a')), 'enough', 'a moment is no wait');
  assert.equal(kindOf(undefined, 0, [], rootOf('a')), 'unknown');
  assert.equal(kindOf(0, 0), 'none');
});

test('services with problems come first, then the busiest', () => {
  const group = (name, here, more) => ({ name, here, uuid: name, instances: [instance({ name, ...more })] });
  assert.deepEqual(byTrouble([group('idle', 1, {}), group('busy', 1, { running: 1 }), group('waits', 1, { waiting: 1 }), group('errors', 1, { errors_per_second: 1 }), group('gone', 0, { goneAt: noon })])
    .map(({ group: { name } }) => name), ['gone', 'errors', 'waits', 'busy', 'idle']);
});

/** Sentences of these sources that the page does not show as a reason, a detail or a finding: answers to commands, parts of the log. */
const noReasons = new Set([
  'no write was requested', 'all reads and writes end before the connection is restored', '{} after {} ms', '{} s',
  'the gateway', 'the answer {}', '{}; nothing is written', 'the response is being written to the controller',
  '{}; start the service, then retry', 'the gateway does not accept this request, so there is no call to act on: {}',
  'no call is pending on this channel', 'the channel has another call now: {}', 'the call\'s response is being written',
  'millrace: no service has this UUID', '{}: {}; move it away or choose another journal folder', 'instance {}', '{} (pid {} on {})',
  'gateway {} (pid {} on {})', '{} at byte {}: the last {} bytes are cut off, as after a crash', '{}: {} {}',
  'this controller shows REQUEST_STATE = 0 only after RESPONSE_STATE is written, if at all; if its kernel clears REQUEST_STATE itself, set kernel_clears_request_state for this machine, and its first response is released earlier',
  'a text of {} bytes; {} are kept', '{} values of more than {} bytes; {} are kept', 'match writers of replies',
  'publishes a call of a gateway', 'cancels a call', 'sends a request in the epoch of a gateway', 'replies to a call of instance {}',
  'publishes the outcome of a command', 'participant {} {}, which belongs to another participant; ignored',
  'would release the NC program, which waits for RESPONSE and does not check RESPONSE_STATE', 'already connected', 'channels 1 to {} have a Service Interface',
  '{} of channel 1 (AMS port {}, index group {})', 'our address',
  // Lines of `millrace controller probe`.
  'no machine data of this task', 'no Service Interface: does the CNC run?', 'ADS state {}', 'AMS port {} ({})', 'sum commands',
  'five variables in one request', '{}: each variable needs its own request', 'of REQUEST_STATE and RESPONSE_STATE are granted', '{}: the gateway polls',
  '{} ms until the service had it, {} ms in its queue, {} ms of work, {} ms back',
  'half a TlsConnectInfo: {}', 'no TLS and TlsConnectInfo in {} ms', 'closed after the handshake (fault)',
  'answered with something other than a TlsConnectInfo (fault)', 'refused with {}', 'the certificate {}', 'the key {}',
  'the key is not an RSA key, and TwinCAT accepts no other kind', 'the key does not belong to the certificate',
  'the certificate cannot be used: {}', 'the CA cannot be used: {}',
  'move key and certificate away, have `millrace controller add-route --self-signed` make new ones and add the route again, then reload this gateway',
  'issue a new certificate of the CA for this gateway, then reload the gateway',
  'install a new CA and certificates from it on controllers and gateway, then reload this gateway',
  'LastGet is {}, not {} as this gateway wrote it: an NC program has initialised the queue (SSDQInit), or another reader uses it; continuing after {}',
  'LastFilled is {}, but element {} was read already: an NC program has initialised the queue (SSDQInit); continuing after LastGet, {}',
  'element {} does not hold the message that was read from it: an NC program has initialised the queue (SSDQInit), or another reader uses it; continuing after LastGet',
  // Names and words in findings, which are the same in German, and errors of the caller of a service.
  'a program', 'the {}', 'ahead of', '{} {}{}', '{} as {}{}', 'transient local', 'manual by participant', 'manual by topic', '{} ms', 'best effort', 'latency budget',
  'liveliness lease', 'destination order', 'by reception', 'by source time', 'learn the own GUID', 'other program', 'the program', 'the gateway\'s configuration (queue {})',
  'the service\'s answer contains a NUL byte', 'the service\'s answer has {} bytes, at most {} fit', 'another gateway has the channel now',
  'the call was cancelled while it ran, and it must not run twice', 'a request with state 0 is not a call; expected 1 or more',
  'the request has {} bytes, at most {} fit', 'call {} is still pending in channel {}',
  'a gateway serves machine \'{}\' on this fabric: a call in {} could replace one of its calls; choose a machine name that no gateway serves',
]);

/** The sentences in a C++ source but for those of its log, with {} for each value. */
function sentencesOf(source) {
  const text = source.replace(/^\s*\/\/.*$/gm, '');
  return [...text.matchAll(/"(?:[^"\\\n]|\\.)*"(?:\s*"(?:[^"\\\n]|\\.)*")*/g)].filter((found) => {
    const before = text.slice(0, found.index);
    const statement = before.slice(Math.max(before.lastIndexOf(';'), before.lastIndexOf('{\n'), before.lastIndexOf('}\n')));
    return !/\b(say|log|warn_limited)\w*\(|log_?->|Level::|#include/.test(statement);
  }).map((found) => found[0].replace(/"\s*"/g, '').slice(1, -1).replace(/\{[^}]*\}/g, '{}').replace(/\\"/g, '"'))
    .filter((sentence) => /[a-z}] [a-z{]/.test(sentence))
    .map((sentence) => (/^[ ;]/.test(sentence) ? '{}' : '') + sentence + (sentence.endsWith(' ') ? '{}' : ''));
}

/** Whether a text contains this sentence, with anything in the place of its values. */
const partOf = (sentence) => new RegExp(sentence.split('{}').map((part) => part.replace(/[.*+?^${}()|[\]\\]/g, '\\$&')).join('.*'));

/** The sentences of these sources, with their files, that none of the German ones stands for. */
function missingOf(files) {
  const root = process.env.MILLRACE_SOURCE;
  const all = files.flatMap((file) => (file.endsWith('.cpp') ? [file] : readdirSync(`${root}/${file}`).filter((name) => name.endsWith('.cpp')).map((name) => `${file}/${name}`)));
  const known = [...reasons, ...findings].map(([sentence]) => sentence);
  return all.flatMap((file) => sentencesOf(readFileSync(`${root}/${file}`, 'utf8'))
    .filter((sentence) => !noReasons.has(sentence) && !known.some((one) => partOf(sentence).test(one))).map((sentence) => `${file}: ${sentence}`));
}

test('each reason of a gateway, each detail of a step and each finding of the doctor has a German sentence', () => {
  const missing = missingOf(['gateway/channel', 'gateway/core', 'gateway/dispatch',
    ...readdirSync(`${process.env.MILLRACE_SOURCE}/gateway/machines`).filter((file) => file.endsWith('.cpp') && file !== 'subscriptions.cpp').map((file) => `gateway/machines/${file}`),
    'gateway/queues', 'gateway/programs', 'gateway/data/sampler.cpp', 'gateway/response.cpp', 'gateway/text.cpp', 'gateway/journal/journal_writer.cpp',
    'gateway/shell/certificate_alarms.cpp', 'gateway/shell/ads_controller.cpp', 'gateway/shell/ads_service_access.cpp', 'gateway/shell/ads_message_queue.cpp', 'cnc/ads/client.cpp',
    'cnc/ads/stream.cpp', 'cnc/ads/link.cpp', 'cnc/ads/secure_handshake.cpp', 'cnc/ads/tls.cpp', 'cnc/ads/requester.cpp', 'cnc/variables/probe.cpp', 'fabric/observer/observer.cpp',
    'services/sdk/call_scheduler.cpp', 'tools/caller', 'tools/replay/data_plan.cpp', 'tools/doctor', 'tools/doctor/checks', 'fabric/endpoints/discovery.cpp']);
  assert.deepEqual(missing, [], 'add them to texts/de_reasons.js or de_findings.js, or to noReasons if the page never shows them');
});

test('a German sentence has all values, and no other sentence takes its place', () => {
  for (const [sentence, wanted] of [...reasons, ...findings]) {
    const values = [...sentence.matchAll(/\{\}/g)].map((_, i) => `<${i}>`);
    const filled = (text) => {
      let next = 0;
      return text.replace(/\{(\d?)\}/g, (_, number) => values[number === '' ? next++ : Number(number)]);
    };
    assert.equal(german.reason(filled(sentence)), filled(wanted));
    assert.ok(values.every((value) => filled(wanted).includes(value)) && !filled(wanted).includes('undefined'), wanted);
  }
});

test('a machine that was never reached is a concern, too; one that has a second gateway is none', () => {
  const down = { connected: false, since: iso(noon), reason: 'refused', gateway_host: 'here' };
  assert.deepEqual(kinds([machine([], [down])], 0), [['cnc', 'link down', 'person']]);
  assert.deepEqual(kinds([machine([], [down, { connected: true, gateway_host: 'there' }])], 0), []);
});

test('a program with a problem needs attention, one with a warning is to be watched, one that is well is no concern', () => {
  const alarm = { responder: 'r', kind: 'archive', subject: '', program: 'archiver', host: 'vm', since: iso(noon - 5000), text: 'disk full', advice: 'make room' };
  const { concerns, counts, level } = assess([], noon, [{ ...alarm, level: 'problem' }, { ...alarm, level: 'warning' }, { ...alarm, level: 'fine' }]);
  assert.deepEqual(concerns.map((concern) => [concernName(concern), concern.kind, concern.level]),
    [['archiver @ vm', 'trouble', 'person'], ['archiver @ vm', 'trouble', 'look']]);
  assert.deepEqual([concerns[0].reason, concerns[0].todo, concerns[0].since, counts.programs, level], ['disk full', 'make room', noon - 5000, 1, 'person']);
});

test('alarms stay until all of them are sent again', () => {
  const model = new Model();
  model.takeSnapshot({ about: { time: iso(noon), started: iso(noon) }, alarms: [{ kind: 'archive' }] }, noon);
  model.takeChanges({ time: iso(noon) }, noon);
  assert.equal(model.alarms.length, 1);
  model.takeChanges({ time: iso(noon), alarms: [] }, noon);
  assert.equal(model.alarms.length, 0);
});

test('an unknown state is to be watched', () => {
  assert.deepEqual(kinds([machine([{ channel_state: 'dreaming' }])], 0), [['cnc/1', 'unknown', 'look']]);
});

const step = (at, hop, attempt, more = {}) => ({ time: iso(noon + at), hop, attempt, by_service: false, ...more });

test('attempts are shown side by side, and a lost one consists of waiting only', () => {
  const { lanes, start, end, ended } = layOut({
    steps: [step(0, 'seen by the gateway', 0), step(1, 'dispatched', 1), step(500, 'instance lost', 1), step(510, 'dispatched', 2),
      step(511, 'received by the instance', 2, { by_service: true }), step(512, 'handler started', 2, { by_service: true }),
      step(520, 'answered by the instance', 2, { by_service: true }), step(521, 'reply at the gateway', 2), step(525, 'written back', 2)],
  });
  assert.equal(end - start, 525);
  assert.ok(ended);
  const bars = lanes.map((lane) => lane.bars.map((bar) => [bar.part, bar.from - noon, bar.to - noon]));
  assert.deepEqual(bars, [
    [['find', 0, 1], ['find', 500, 510], ['writeBack', 521, 525]],
    [['wait', 1, 500]],
    [['toService', 510, 511], ['queue', 511, 512], ['work', 512, 520], ['toGateway', 520, 521]]]);
});

test('a service whose clock is ahead is shown where it must have been', () => {
  const { steps } = layOut({
    steps: [step(0, 'dispatched', 1), step(9000, 'received by the instance', 1, { by_service: true }), step(10, 'reply at the gateway', 1)],
  });
  assert.equal(steps[1].at - noon, 10);
});

test('a call under way reaches to now', () => {
  const { end, ended, lanes } = layOut({ steps: [step(0, 'seen by the gateway', 0), step(1, 'no service has this UUID', 0)] }, noon + 4000);
  assert.equal(end - noon, 4000);
  assert.ok(!ended);
  assert.deepEqual(lanes[0].bars.at(-1), { part: 'unserved', from: noon + 1, to: noon + 4000 });
});

test('an empty timeline draws nothing', () => {
  assert.deepEqual(layOut({ steps: [] }).lanes, []);
});

test('a call that was blocked for minutes has a broken axis, and the width of its steps remains their duration', () => {
  const bar = { part: 'held', from: 100, to: 600_100 };
  const layout = { start: 0, end: 600_200, lanes: [{ bars: [{ part: 'find', from: 0, to: 100 }, bar, { part: 'writeBack', from: 600_100, to: 600_200 }] }] };
  const sut = scaleOf(layout);
  assert.deepEqual([0, 50, 100, 300_100, 600_100, 600_200].map((time) => Number(sut.at(time).toFixed(6))), [0, 0.1875, 0.375, 0.5, 0.625, 1]);
  assert.ok(sut.broken(bar));
  const marks = marksOf(sut, 0);
  assert.deepEqual([marks[0].after, marks[0].isMore], [0, false]);
  assert.ok(marks.some((mark) => mark.after === 600_100 && !mark.isMore), 'where it goes on, since when the call began');
  assert.ok(marks.at(-1).isMore, 'and from there on the time since then');
  assert.ok(marks.every((mark, i) => i === 0 || mark.place - marks[i - 1].place > 0.07));
});

test('a call that was blocked for a moment has a whole axis', () => {
  const sut = scaleOf({ start: 1000, end: 1100, lanes: [{ bars: [{ part: 'held', from: 1010, to: 1050 }] }] });
  assert.deepEqual([sut.at(1000), sut.at(1050), sut.at(1100), sut.pieces.length], [0, 0.5, 1, 1]);
});

test('an axis has round steps', () => {
  assert.deepEqual(ticks(0, 940), [0, 200, 400, 600, 800]);
  assert.deepEqual(ticks(0, 0), [0]);
  assert.ok(ticks(0, 0.0123).length <= 6);
});

test('a restarted gateway replaces its predecessor', () => {
  const sut = new Model();
  const link = (gateway, host, connected) => ({ machine: 'cnc', gateway, gateway_host: host, gone: host === '', connected, since: iso(noon) });
  sut.takeSnapshot({ about: about(), machines: [link('old', 'here', true)] }, 0);
  sut.takeChanges({ time: iso(noon), machines: [link('old', '', false)] }, 0);
  assert.deepEqual(kinds(sut.plant(), 0), [['cnc', 'gone', 'person']]);
  sut.takeChanges({ time: iso(noon), machines: [link('new', 'here', true)] }, 0);
  assert.deepEqual(sut.plant()[0].links.map((each) => each.gateway), ['new']);
});

test('a service is called what its instances have in common', () => {
  const nameOf = (...names) => {
    const sut = new Model();
    sut.takeSnapshot({ about: about(), services: names.map((name, i) => ({ instance: String(i), uuid: 'u', name })) }, 0);
    return sut.servicesByUuid()[0].name;
  };
  assert.equal(nameOf('square root 1', 'square root 2'), 'square root');
  assert.equal(nameOf('gauge 7'), 'gauge 7');
  assert.equal(nameOf('gauge', 'mail'), 'gauge');
  assert.equal(nameOf(''), '');
});

const series = (times, values, whole = true) => ({ whole, times, values, quality: 'good' });

test('a value holds until the next one, and the last one until now', () => {
  const sut = new Line('1/axes/X');
  sut.take(series([1000, 2000], [5, 7]));
  assert.deepEqual(sut.points(500, 3000), [[1000, 5], [2000, 7], [3000, 7]]);
  assert.deepEqual(sut.points(1500, 3000), [[1500, 5], [2000, 7], [3000, 7]]);
  assert.deepEqual(sut.points(2500, 3000), [[2500, 7], [3000, 7]], 'what began before holds, too');
  assert.deepEqual(sut.points(0, 500), [], 'nothing is known before the first');
});

test('where nothing is known a line has a gap', () => {
  const sut = new Line('1/axes/X');
  sut.take(series([1000, 2000, 3000], [5, null, 6]));
  assert.deepEqual(sut.points(0, 4000), [[1000, 5], [1999, 5], [2000, null], [3000, 6], [4000, 6]]);
  assert.deepEqual(sut.points(2500, 4000), [[3000, 6], [4000, 6]]);
  sut.take(series([1000, 2000], [5, null]));
  assert.deepEqual(sut.points(2500, 4000), []);
});

test('a line is assembled from the parts that arrive', () => {
  const sut = new Line('1/axes/X');
  assert.equal(sut.ask(), 0);
  sut.take(series([1000, 2000, 2100], [1, 2, 3]));
  assert.equal(sut.ask(), 1600);
  // The last value sent has changed since: of fast values the server keeps the lowest, the highest
  // and the last.
  sut.take(series([2000, 2200, 2300], [2, 9, 4], false));
  assert.deepEqual(sut.points(0, 2300), [[1000, 1], [2000, 2], [2200, 9], [2300, 4], [2300, 4]]);
  sut.take(series([5000], [8]));
  assert.deepEqual(sut.points(0, 6000), [[5000, 8], [6000, 8]], 'the server began anew');
  sut.take(series([1000, 2000, 3000], [1, 2, 3]));
  sut.forget(2500);
  assert.deepEqual(sut.points(0, 3000), [[2000, 2], [3000, 3], [3000, 3]]);
});

test('numbers are drawn, texts and arrays are not', () => {
  assert.ok(isNumber({ type: 'REAL64', value: 1 }));
  assert.ok(isNumber({ type: 'BOOLEAN', value: true }));
  assert.ok(!isNumber({ type: 'STRING', value: 'x' }));
  assert.ok(!isNumber({ type: 'SGN32', value: [1] }));
  assert.ok(!isNumber({ type: 'UNKNOWN', value: null }));
  assert.deepEqual(variablesOf([{ channel: 2, group: 'axes', values: [{ name: 'X' }] }]).map(({ id }) => id), ['2/axes/X']);
  assert.deepEqual([qualityOf(true, 'good'), qualityOf(true, 'refused'), qualityOf(false, 'good')], ['stale', 'refused', 'good']);
});

test('a run has its place in the time that is shown', () => {
  assert.deepEqual(placeOf(100, 200, 0, 1000), { left: 0.1, width: 0.1 });
  assert.deepEqual(placeOf(-500, 500, 0, 1000), { left: 0, width: 0.5 });
  assert.equal(placeOf(-500, -100, 0, 1000), null);
  assert.equal(placeOf(2000, 3000, 0, 1000), null);
  assert.equal(placeOf(NaN, 3000, 0, 1000), null);
});
