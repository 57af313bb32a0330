// How tshark, whose AMS dissector knows nothing of millrace, sees a client and the virtual CNC on
// the loopback interface. One request at a time, since that dissector takes each TCP segment for
// one frame.
import assert from 'node:assert/strict';
import { spawn, spawnSync } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { setTimeout } from 'node:timers/promises';
import { Client } from 'ads-client';
import { adsClientSettings, limit, startVirtualCnc } from './virtual_cnc.mjs';

const fields = [
  'tcp.srcport', 'ams.targetnetid', 'ams.targetport', 'ams.sendernetid', 'ams.senderport', 'ams.cmdid',
  'ams.stateflags', 'ams.cbdata', 'ams.errorcode', 'ams.invokeid', 'ams.ads_indexgroup', 'ams.ads_indexoffset',
  'ams.ads_cblength', 'ams.ads_cbreadlength', 'ams.ads_cbwritelength', 'ams.adsresult', 'ams.ads_state',
  'ams.ads_devicename', 'tcp.payload', '_ws.malformed',
];
const readDeviceInfo = 1;
const read = 2;
const write = 3;
const readState = 4;
const addNotification = 6;
const deleteNotification = 7;
const notification = 8;
const readWrite = 9;
const name = Buffer.from('V.G.SERVICE.REQUEST\0', 'latin1');

let folder;
let cnc;
let capture;
let packets;
let skip;

/** Why this host cannot capture on the loopback interface, if it cannot. */
function missing() {
  const version = spawnSync('tshark', ['--version']);
  if (version.error) {
    return 'tshark is not installed (deploy/install-deps)';
  }
  const interfaces = spawnSync('tshark', ['-D'], { encoding: 'utf8' });
  if (!/\blo\b/.test(interfaces.stdout)) {
    return 'no right to capture on the loopback interface';
  }
  const probe = spawnSync('tshark', ['-i', 'lo', '-c', '1', '-a', 'duration:1', '-w', '/dev/null'], { encoding: 'utf8' });
  return probe.status === 0 ? undefined : `no right to capture on the loopback interface: ${probe.stderr.trim()}`;
}

/** Captures into a file; resolves once the capture runs. */
function startCapture(file, port) {
  const child = spawn('tshark', ['-i', 'lo', '-f', `tcp port ${port}`, '-w', file, '-P', '-l', '-T', 'fields', '-e', 'frame.number'],
    { stdio: ['ignore', 'pipe', 'pipe'] });
  const state = { seen: 0, ended: new Promise((resolve) => child.once('exit', resolve)) };
  child.stdout.on('data', (chunk) => (state.seen += chunk.toString().split('\n').length - 1));
  state.stop = async () => {
    child.kill('SIGINT');
    await state.ended;
  };
  return new Promise((resolve, reject) => {
    let said = '';
    child.once('exit', (code) => reject(new Error(`tshark ended with ${code}: ${said}`)));
    child.stderr.on('data', (chunk) => {
      said += chunk;
      if (/Capturing on|Capture started/.test(said)) {
        resolve(state);
      }
    });
  });
}

/** Every AMS frame of a capture, as tshark decodes it. */
function decode(file, port) {
  // While the capture still runs, its last packet may be incomplete, which tshark reports as a
  // failure.
  const { stdout: output } = spawnSync('tshark', ['-r', file, '-d', `tcp.port==${port},ams`, '-Y', 'ams',
    '-T', 'fields', ...fields.flatMap((field) => ['-e', field]), '-E', 'separator=|', '-E', 'occurrence=f'],
  { encoding: 'utf8' });
  return output.trimEnd().split('\n').filter(Boolean).map((line) => {
    const values = line.split('|');
    return Object.fromEntries(fields.map((field, i) => [field.replace(/^.*\./, ''), values[i]]));
  });
}

before(async () => {
  skip = missing();
  if (skip) {
    return;
  }
  folder = mkdtempSync(join(tmpdir(), 'millrace-capture-'));
  const file = join(folder, 'loopback.pcapng');
  cnc = await startVirtualCnc();
  capture = await startCapture(file, cnc.port);
  const client = new Client(adsClientSettings(cnc.port, 553));
  // tshark reports that it captures too early, on a busy host by seconds: connect until one connection was seen.
  for (const end = Date.now() + limit; capture.seen === 0 && Date.now() < end;) {
    await client.connect();
    await client.readState();
    await client.disconnect();
    await setTimeout(10);
  }
  await client.connect();
  await client.readDeviceInfo();
  await client.readState();
  await client.readRaw(0x120100, 0x3, 24);
  await client.writeRaw(0x120101, 0x9, Buffer.from([0xe8, 0x03]));
  await client.writeRaw(0x122301, 0x4a, Buffer.concat([name, Buffer.from('ma\xdf\0', 'latin1')]), { adsPort: 552 });
  await client.readWriteRaw(0x122301, 0x48, 128, name, { adsPort: 552 });
  await client.readRaw(0x120100, 0x999, 4).catch(() => {});
  await new Promise((resolve, reject) =>
    client.subscribeRaw(0x120100, 0x3, 24, () => resolve(), 10, true).catch(reject));
  await client.unsubscribeAll();
  await client.disconnect();
  const frames = () => decode(file, cnc.port);
  for (const end = Date.now() + limit; Date.now() < end;) {
    packets = frames();
    if (packets.some((packet) => packet.cmdid === String(deleteNotification) && flagsOf(packet) === 5)) {
      break;
    }
  }
  await capture.stop();
  // A starting capture may have a request without its response: libpcap drops packets while it sets
  // its filter.
  const all = frames();
  packets = all.slice(all.findIndex((packet) => commandOf(packet) === readDeviceInfo));
  assert.equal(commandOf(packets[0] ?? {}), readDeviceInfo, 'tshark has decoded no AMS frame');
});

after(async () => {
  // A running capture would keep this process alive.
  await capture?.stop();
  await cnc?.stop();
  if (folder) {
    rmSync(folder, { recursive: true });
  }
});

const numberOf = (packet, field) => Number(packet[field]);
const flagsOf = (packet) => Number(packet.stateflags);
const commandOf = (packet) => Number(packet.cmdid);

/** The requests of a command with their responses, by invoke id. */
function exchanges(command) {
  const requests = packets.filter((packet) => commandOf(packet) === command && flagsOf(packet) === 4);
  return requests.map((request) => ({
    request,
    response: packets.find((packet) =>
      commandOf(packet) === command && flagsOf(packet) === 5 && packet.invokeid === request.invokeid),
  }));
}

const decoded = (title, check) =>
  test(title, (context) => (skip ? context.skip(skip) : check()));

decoded('every frame is a whole AMS frame, and every request has its response', () => {
  assert.ok(packets.length >= 18, `${packets.length} frames`);
  for (const packet of packets) {
    assert.equal(packet.malformed, '', JSON.stringify(packet));
    assert.equal(numberOf(packet, 'errorcode'), 0);
  }
  for (const command of [readDeviceInfo, readState, read, write, readWrite, addNotification, deleteNotification]) {
    const all = exchanges(command);
    assert.ok(all.length > 0, `command ${command}`);
    for (const { request, response } of all) {
      assert.ok(response, JSON.stringify(request));
    }
  }
});

decoded('a response goes back where its request came from', () => {
  const [{ request, response }] = exchanges(readDeviceInfo);
  assert.equal(request.targetnetid, '127.0.0.1.1.1');
  assert.equal(request.targetport, '553');
  for (const part of ['netid', 'port']) {
    assert.equal(response[`target${part}`], request[`sender${part}`]);
    assert.equal(response[`sender${part}`], request[`target${part}`]);
  }
  assert.equal(numberOf(response, 'srcport'), cnc.port);
});

decoded('a read has its group, offset and length, and the bytes of the value', () => {
  const { request, response } = exchanges(read).find(({ request: { ads_indexoffset } }) => Number(ads_indexoffset) === 3);
  assert.equal(numberOf(request, 'ads_indexgroup'), 0x120100);
  assert.equal(numberOf(request, 'ads_cblength'), 24);
  assert.equal(numberOf(response, 'adsresult'), 0);
  assert.equal(numberOf(response, 'ads_cblength'), 24);
  assert.equal(numberOf(response, 'cbdata'), 8 + 24);
});

decoded('a failed read is 8 bytes with its error', () => {
  const { response } = exchanges(read).find(({ request: { ads_indexoffset } }) => Number(ads_indexoffset) === 0x999);
  assert.equal(numberOf(response, 'cbdata'), 8);
  // The dissector parses longer ones only.
  assert.ok(response.payload.endsWith('03070000' + '00000000'), response.payload);
});

decoded('a write by name carries name and value, a read by name gives the whole string', () => {
  const { request } = exchanges(write).find(({ request: { targetport } }) => targetport === '552');
  assert.equal(numberOf(request, 'ads_indexgroup'), 0x122301);
  assert.equal(numberOf(request, 'ads_indexoffset'), 0x4a);
  assert.equal(numberOf(request, 'ads_cblength'), name.length + 4);
  const { request: asked, response } = exchanges(readWrite)[0];
  assert.equal(numberOf(asked, 'ads_cbreadlength'), 128);
  assert.equal(numberOf(asked, 'ads_cbwritelength'), name.length);
  assert.equal(numberOf(response, 'ads_cblength'), 128);
  assert.ok(response.payload.includes('6d61df00'), response.payload); // CP1252
});

decoded('the device tells its state and its name', () => {
  assert.equal(numberOf(exchanges(readState)[0].response, 'ads_state'), 5);
  assert.match(exchanges(readDeviceInfo)[0].response.ads_devicename, /^millrace/);
});

decoded('a notification comes behind the answer to its subscription, to the subscriber, with invoke id 0', () => {
  const subscribed = packets.findIndex((packet) => commandOf(packet) === addNotification && flagsOf(packet) === 5);
  const sample = packets.findIndex((packet) => commandOf(packet) === notification);
  assert.ok(subscribed >= 0 && sample > subscribed, `${subscribed} ${sample}`);
  assert.equal(flagsOf(packets[sample]), 4);
  assert.equal(numberOf(packets[sample], 'invokeid'), 0);
  assert.equal(packets[sample].targetnetid, packets[subscribed].targetnetid);
  assert.equal(packets[sample].targetport, packets[subscribed].targetport);
});
