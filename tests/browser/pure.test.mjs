// The page's functions that draw nothing: the model, open problems, the time axis, and complete
// texts in both languages.
import assert from 'node:assert/strict';
import { readdirSync, readFileSync } from 'node:fs';
import { test } from 'node:test';
import { adviceOf, matrixOf, mayServe, mostColumns } from './page/capacity.js';
import { acknowledgementOf, concernName, headlineOf, otherChannels, shapeOf, worstOf } from './page/concerns.js';
import { isNumber, Line, pathOf, placeOf, qualityOf, rangeOf, ticks, timeTicks, variablesOf } from './page/lines.js';
import { busyOfMinute, byTrouble, keptCalls, loadOf, Model, toolOf } from './page/model.js';
import { inOrder, isService, machinesWith, nextOrder, orderOf } from './page/search.js';
import german from './page/texts/de.js';
import { messages } from './page/texts/de_messages.js';
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

const onChannels = (kind, level, ...numbers) => ({
  kind, level, subject: 'all of them', machines: ['cnc'], channels: numbers.map((channel) => ({ machine: 'cnc', channel })),
});
const alarmOf = (level) => ({ kind: 'alarm', level, subject: 'archiver on vm, pid 7' });

test('the headline counts what needs a person, by what it is about', () => {
  const headline = (...concerns) => Object.values(headlineOf(concerns)).join(' ');
  const down = { kind: 'link down', level: 'act', subject: 'cnc', machines: ['cnc'], channels: [{ machine: 'cnc', channel: 1 }] };
  assert.deepEqual([headline(), headline(alarmOf('look')), headline(onChannels('waiting', 'look', 1, 2)), headline(alarmOf('act'), alarmOf('look')), headline(down),
    headline(onChannels('held', 'act', 1)), headline(onChannels('held', 'act', 1), down)],
  ['well 0', 'warns 0', 'look 2', '1 needsPrograms', '1 needsMachines', '1 needs', '2 needsMixed']);
  assert.deepEqual(worstOf([onChannels('held', 'act', 1), alarmOf('look')]), { level: 'act', count: 1 });
});

test('a card is named by its first channel, or by all that it is about', () => {
  assert.deepEqual([concernName(onChannels('unserved', 'act', 2, 1)), otherChannels(onChannels('unserved', 'act', 2, 1))], ['cnc/2', ['cnc/1']]);
  assert.deepEqual([concernName(onChannels('link down', 'act', 1)), otherChannels(onChannels('link down', 'act', 1, 2))], ['all of them', []]);
  assert.equal(concernName(alarmOf('act')), 'archiver on vm, pid 7');
});

test('each kind of concern that the server knows has a shape, and each role a word', () => {
  const source = readFileSync(`${process.env.MILLRACE_SOURCE}/fabric/plant/concern.cpp`, 'utf8');
  const namesIn = (list) => [...list.matchAll(/"([a-z ]+)"/g)].map(([, name]) => name);
  const [, kinds] = /name_of\(Kind[^{]*\{[^{]*\{([^}]*)\}/.exec(source);
  const [, roles] = /name_of\(Role[^{]*\{[^{]*\{([^}]*)\}/.exec(source);
  assert.ok(namesIn(kinds).length > 10 && namesIn(roles).length === 3);
  assert.deepEqual(namesIn(kinds).filter((kind) => kind !== 'missing' && !shapeOf[kind]), []);
  assert.deepEqual(namesIn(roles).filter((role) => !english.roles[role] || !german.roles[role]), []);
});

test('an acknowledged cause keeps its user until it is over, and the next one has none', () => {
  const concernSince = (since, more = {}) => ({ cause: 'unserved u', since: iso(since), ...more });
  const taken = { cause: 'unserved u', by: 'anna', since: iso(noon), note: '', time: iso(noon + 5000) };
  assert.equal(acknowledgementOf(concernSince(noon), [taken])?.by, 'anna');
  assert.equal(acknowledgementOf(concernSince(noon + 9000), [taken]), null);
  // The gateway's clock is an hour ahead.
  assert.equal(acknowledgementOf(concernSince(noon + 3_600_000), [{ ...taken, since: iso(noon + 3_600_000) }])?.by, 'anna');
  assert.equal(acknowledgementOf(concernSince(noon, { cause: 'gateway gone g' }), [taken]), null);
  // A cause without a begin.
  assert.equal(acknowledgementOf({ cause: 'unserved u' }, [taken])?.by, 'anna');
});

test('what the server has no longer is on no view', () => {
  const sut = new Model();
  sut.takeSnapshot({ about: about(), machines: [{ machine: 'cnc', gateway: 'g' }], channels: [{ machine: 'cnc', channel: 1 }], concerns: [alarmOf('act')] }, 0);
  sut.takeChanges({ time: iso(noon), gone: { channels: [{ machine: 'cnc', channel: 1 }], machines: [{ machine: 'cnc', gateway: 'g' }] } }, 0);
  assert.deepEqual([sut.plant(), sut.concerns.length], [[], 1]);
  sut.takeChanges({ time: iso(noon), concerns: [] }, 0);
  assert.equal(sut.concerns.length, 0);
});

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

test('reasons of a gateway are in German', () => {
  assert.equal(german.reason('connection refused'), '');
  const silent = { code: 'no_connection_in', arguments: ['2000'], text: 'no connection in 2000 ms: is the host on, is a firewall between?' };
  assert.equal(german.reason({ code: 'about', arguments: ['10.0.0.7:48898', silent] }),
    '10.0.0.7:48898: keine Verbindung in 2000 ms. Ist der Rechner eingeschaltet? Blockiert eine Firewall?');
  const empty = { code: 'answer_of_service', arguments: [{ code: 'response_empty', arguments: [] }] };
  assert.equal(german.reason({ code: 'refused_with_state', arguments: [empty, '3'] }),
    'Die Antwort des Dienstes ist leer; ein NC-Programm, das auf RESPONSE wartet, läuft damit nicht weiter. Das NC-Programm erhält Zustand 3.');
  assert.equal(english.reason('all 3 instances are busy'), '');
  const lost = { code: 'instance_lost_held', arguments: ['sq1 (pid 7 on hall)'] };
  assert.equal(english.reason(lost), 'sq1 (hall, pid 7) exited during this call, which may run only once.');
  assert.match(german.reason(lost), /sq1 \(Prozess 7 auf hall\)/);
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

test('each sentence of the catalogue is made somewhere', () => {
  const root = process.env.MILLRACE_SOURCE;
  const sources = (folder) => readdirSync(`${root}/${folder}`, { withFileTypes: true }).flatMap((entry) => (entry.isDirectory() ? sources(`${folder}/${entry.name}`)
    : /\.[ch]pp$/.test(entry.name) ? [readFileSync(`${root}/${folder}/${entry.name}`, 'utf8')] : []));
  const text = ['base', 'cnc', 'fabric', 'gateway', 'services', 'tools'].flatMap(sources).join('\n');
  const used = new Set([...text.matchAll(/messages::(\w+)/g)].map(([, code]) => code));
  assert.deepEqual(Object.keys(messages).filter((code) => !used.has(code)), []);
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
  const source = readFileSync(`${process.env.MILLRACE_SOURCE}/fabric/plant/event_kinds.def`, 'utf8');
  const kinds = [...source.matchAll(/^MILLRACE_EVENT_KIND\(\w+, "([a-z ]+)"\)$/gm)].map(([, kind]) => kind);
  const isKind = (name) => !['title', 'none', 'since', 'more'].includes(name) && !name.startsWith('last ');
  assert.deepEqual(Object.keys(english.events).filter(isKind).sort(), kinds.sort());
  for (const kind of kinds) {
    for (const texts of [english, german]) {
      assert.match(texts.events[kind]({ name: 'n', where: 'w', machines: 'm', channel: 'm/1', service: 's', text: 't' }), /[nm]/, kind);
    }
  }
});

const instance = (more) => ({ instance: '1', uuid: 'u', name: 'a', concurrency: 1, running: 0, waiting: 0, calls_per_second: 0, errors_last_minute: 0, ...more });

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
  assert.deepEqual(byTrouble([group('idle', 1, {}), group('busy', 1, { running: 1 }), group('waits', 1, { waiting: 1 }), group('errors', 1, { errors_last_minute: 1 }), group('gone', 0, { goneAt: noon })])
    .map(({ group: { name } }) => name), ['gone', 'errors', 'waits', 'busy', 'idle']);
});

test('a machine is found by its name, and a channel by its number, service or UUID', () => {
  const lathe = { name: 'Lathe_1', channels: [{ machine: 'Lathe_1', channel: 1, service: 'laser marker', uuid: 'B1' }, { machine: 'Lathe_1', channel: 12 }] };
  const mill = { name: 'mill_2', channels: [{ machine: 'mill_2', channel: 1, service: 'square root', uuid: 'C2' }] };
  const found = (wanted) => machinesWith([lathe, mill, { name: 'bare', channels: [] }], wanted).map(({ name, channels }) => [name, ...channels.map(({ channel }) => channel)]);
  assert.deepEqual(found(''), [['Lathe_1', 1, 12], ['mill_2', 1], ['bare']]);
  assert.deepEqual(found(' lathe '), [['Lathe_1', 1, 12]]);
  assert.deepEqual([found('1/12'), found('marker'), found('c2'), found('bar'), found('drill')], [[['Lathe_1', 12]], [['Lathe_1', 1]], [['mill_2', 1]], [['bare']], []]);
});

test('a service is found by its name, its UUID, and the names and hosts of its instances', () => {
  const service = { name: 'square root', uuid: '560aacbf', instances: [{ name: 'square root A', host: 'hall-3' }, { host: 'vm' }] };
  assert.deepEqual(['ROOT', '560AAC', 'root a', 'hall-3', '', 'hall-4'].map((wanted) => isService(service, wanted)), [true, true, true, true, true, false]);
});

test('services are in the order of a column, those without a value last', () => {
  const service = (name, rate, p50) => ({ group: { name, here: 1 }, load: { rate, p50 } });
  const services = [service('m10', 3, 9), service('m2', 1, undefined), service('m3', 3, 7)];
  const namesBy = (text) => inOrder(services, orderOf(text)).map(({ group: { name } }) => name);
  assert.deepEqual([namesBy(''), namesBy('unknown'), namesBy('constructor')], Array(3).fill(['m10', 'm2', 'm3']));
  assert.deepEqual([namesBy('name'), namesBy('-name')], [['m2', 'm3', 'm10'], ['m10', 'm3', 'm2']]);
  assert.deepEqual([namesBy('-rate'), namesBy('rate')], [['m3', 'm10', 'm2'], ['m2', 'm3', 'm10']]);
  assert.deepEqual([namesBy('p50'), namesBy('-p50')], [['m3', 'm10', 'm2'], ['m10', 'm3', 'm2']]);
});

test('a column is sorted by its first click, the other way by the second, and not by the third', () => {
  const clicks = (column) => [1, 2, 3].reduce((orders) => [...orders, nextOrder(orders.at(-1), column)], ['busy']).slice(1);
  assert.deepEqual([clicks('name'), clicks('rate')], [['name', '-name', ''], ['-rate', 'rate', '']]);
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
  assert.deepEqual(sut.plant()[0].links.map((each) => each.gone), [true]);
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
  // Of a later version.
  assert.equal(qualityOf(false, 'unknown (200)'), 'unknown');
});

test('a run has its place in the time that is shown', () => {
  assert.deepEqual(placeOf(100, 200, 0, 1000), { left: 0.1, width: 0.1 });
  assert.deepEqual(placeOf(-500, 500, 0, 1000), { left: 0, width: 0.5 });
  assert.equal(placeOf(-500, -100, 0, 1000), null);
  assert.equal(placeOf(2000, 3000, 0, 1000), null);
  assert.equal(placeOf(NaN, 3000, 0, 1000), null);
});
