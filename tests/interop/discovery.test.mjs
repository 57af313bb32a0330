// Discovery of controllers over UDP, and routes: our server gets hand-made bytes, and our command
// talks to a hand-made controller, with the messages of Beckhoff's AdsLib and ads-rs.
import assert from 'node:assert/strict';
import { spawn } from 'node:child_process';
import { createSocket } from 'node:dgram';
import { once } from 'node:events';
import { mkdtempSync, rmSync, statSync, writeFileSync } from 'node:fs';
import { connect } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { startConfiguredCnc } from './virtual_cnc.mjs';

const ours = [127, 0, 0, 1, 2, 1];
const controller = [127, 0, 0, 1, 1, 1];
const text = (content) => Buffer.from(`${content}\0`, 'latin1');

function datagram(service, netId, tags = [], invokeId = 7) {
  const head = Buffer.alloc(24);
  head.writeUInt32LE(0x71146603, 0);
  head.writeUInt32LE(invokeId, 4);
  head.writeUInt32LE(service, 8);
  Buffer.from(netId).copy(head, 12);
  head.writeUInt16LE(10000, 18);
  head.writeUInt32LE(tags.length, 20);
  return Buffer.concat([head, ...tags.flatMap(([id, data]) => {
    const header = Buffer.alloc(4);
    header.writeUInt16LE(id, 0);
    header.writeUInt16LE(data.length, 2);
    return [header, data];
  })]);
}

function tagsOf(bytes) {
  const tags = new Map();
  for (let at = 24; at < bytes.length; at += 4 + bytes.readUInt16LE(at + 2)) {
    tags.set(bytes.readUInt16LE(at), bytes.subarray(at + 4, at + 4 + bytes.readUInt16LE(at + 2)));
  }
  return tags;
}

async function ask(port, bytes) {
  const socket = createSocket('udp4');
  socket.send(bytes, port, '127.0.0.1');
  const [answer] = await once(socket, 'message');
  socket.close();
  return answer;
}

/** Whether plain ADS answers a ReadState of our NetId, or closes the connection. */
async function isKnown(port) {
  const frame = Buffer.alloc(38);
  frame.writeUInt32LE(32, 2);
  Buffer.from(controller).copy(frame, 6);
  frame.writeUInt16LE(552, 12);
  Buffer.from(ours).copy(frame, 14);
  frame.writeUInt16LE(32750, 20);
  frame.writeUInt16LE(4, 22);
  frame.writeUInt16LE(4, 24);
  const socket = connect(port, '127.0.0.1');
  socket.on('error', () => {});
  socket.write(frame);
  const known = await new Promise((resolve) => {
    socket.once('data', () => resolve(true));
    socket.once('close', () => resolve(false));
  });
  socket.destroy();
  return known;
}

/** The command; what it said and how it ended. */
function millrace(...words) {
  const child = spawn(join(process.env.MILLRACE_BIN, 'millrace'), words, { stdio: ['ignore', 'pipe', 'pipe'] });
  let [output, errors] = ['', ''];
  child.stdout.on('data', (chunk) => (output += chunk));
  child.stderr.on('data', (chunk) => (errors += chunk));
  return new Promise((resolve) => child.once('close', (code) => resolve({ code, output, errors })));
}

const folder = mkdtempSync(join(tmpdir(), 'millrace-discovery-'));
const password = join(folder, 'password');
let cnc;

before(async () => {
  writeFileSync(password, '1\n', { mode: 0o600 });
  cnc = await startConfiguredCnc(`
    discovery { listen: "127.0.0.1:0" name: "press" user: "Administrator" password: "1" }
    secure_ads { listen: "127.0.0.1:0" self_signed { user: "Administrator" password: "1" } }`);
});

after(async () => {
  await cnc?.stop();
  rmSync(folder, { recursive: true });
});

test('the virtual CNC says who it is', async () => {
  const answer = await ask(cnc.discoveryPort, datagram(1, [0, 0, 0, 0, 0, 0]));
  assert.equal(answer.readUInt32LE(0), 0x71146603);
  assert.equal(answer.readUInt32LE(4), 7);
  assert.equal(answer.readUInt32LE(8), 0x80000001);
  assert.deepEqual([...answer.subarray(12, 18)], controller);
  assert.deepEqual(tagsOf(answer).get(5), text('press'));
  assert.match(tagsOf(answer).get(18).toString(), /^([0-9A-F]{2}:){31}[0-9A-F]{2}\0$/);
});

test('it closes the connection of a client until that has added a route', async () => {
  const route = (secret) => datagram(6, ours, [[7, Buffer.from(ours)], [13, text('Administrator')], [2, text(secret)],
    [5, text('127.0.0.1')], [12, text('gateway')]]);
  const status = async (secret) => tagsOf(await ask(cnc.discoveryPort, route(secret))).get(1).readUInt32LE();
  assert.equal(await isKnown(cnc.port), false);
  assert.equal(await status('2'), 0x704);
  assert.equal(await isKnown(cnc.port), false);
  assert.equal(await status('1'), 0);
  assert.equal(await isKnown(cnc.port), true);
});

test('the command finds a controller', async () => {
  const socket = createSocket('udp4');
  const system = Buffer.alloc(276);
  [276, 10, 0, 19041, 2].forEach((value, at) => system.writeUInt32LE(value, 4 * at));
  let asked;
  socket.on('message', (question, peer) => {
    asked = question;
    socket.send(datagram(0x80000001, [192, 168, 10, 5, 1, 1],
      [[5, text('CX-123456')], [4, system], [3, Buffer.from([3, 1, 0xb8, 0x0f])], [18, text('ab'.repeat(32))]],
      question.readUInt32LE(4)), peer.port, peer.address);
  });
  socket.bind(0, '127.0.0.1');
  await once(socket, 'listening');
  const { port } = socket.address();
  const found = await millrace('controller', 'find', '--address', '127.0.0.1', '--port', `${port}`, '--json');
  assert.equal(found.code, 0, found.errors);
  const [{ plain_ads, secure_ads, ...one }] = JSON.parse(found.output);
  assert.deepEqual(one, { name: 'CX-123456', address: '127.0.0.1', net_id: '192.168.10.5.1.1', twincat: '3.1.4024',
    system: 'Windows NT 10.0.19041', fingerprint: 'ab'.repeat(32) });
  assert.deepEqual(asked, datagram(1, [0, 0, 0, 0, 0, 0], [], asked.readUInt32LE(4)));
  const table = await millrace('controller', 'find', '--address', '127.0.0.1', '--port', `${port}`);
  assert.match(table.output, /^NAME +ADDRESS +NETID .*\nCX-123456 +127\.0\.0\.1 +192\.168\.10\.5\.1\.1 +3\.1\.4024 /);
  socket.close();
  const none = await millrace('controller', 'find', '--address', '127.0.0.1', '--port', `${port}`);
  assert.equal(none.code, 1);
  assert.match(none.errors, /no controller responded/);
});

test('the command broadcasts only if it is told to', async () => {
  const refused = await millrace('controller', 'find', '--interface', 'lo');
  assert.equal(refused.code, 2);
  assert.match(refused.errors, /confirm with --broadcast/);
});

const addRoute = (...words) => millrace('controller', 'add-route', '127.0.0.1', '--net-id', '10.0.0.9.1.1', '--user', 'Administrator',
  '--password-file', password, ...words);

test('the command adds a route for plain ADS, and says that the password can be read', async () => {
  const added = await addRoute('--plain', '--port', `${cnc.discoveryPort}`);
  assert.equal(added.code, 0, added.errors);
  assert.match(added.errors, /travels in clear text/);
  assert.match(added.output, /has a route from NetId 10\.0\.0\.9\.1\.1 to 127\.0\.0\.1/);
  writeFileSync(password, '2\n');
  const refused = await addRoute('--plain', '--port', `${cnc.discoveryPort}`);
  writeFileSync(password, '1\n');
  assert.equal(refused.code, 1);
  assert.match(refused.errors, /no route was added: 0x704/);
});

test('the command asks a controller for a route that it forgets', async () => {
  const socket = createSocket('udp4');
  let asked;
  socket.on('message', (question, peer) => {
    asked = question;
    socket.send(datagram(0x80000006, controller, [[1, Buffer.alloc(4)]], question.readUInt32LE(4)), peer.port, peer.address);
  });
  socket.bind(0, '127.0.0.1');
  await once(socket, 'listening');
  const added = await addRoute('--plain', '--temporary', '--name', 'gateway', '--port', `${socket.address().port}`);
  socket.close();
  assert.match(added.output, /until it is restarted/, added.errors);
  const tags = tagsOf(asked);
  assert.equal(tags.get(9).readUInt32LE(), 1, 'temporary');
  assert.deepEqual([tags.get(12), tags.get(13), tags.get(2)], ['gateway', 'Administrator', '1'].map(text));
  const safe = await addRoute('--self-signed', folder, '--temporary');
  assert.equal(safe.code, 2);
  assert.match(safe.errors, /--temporary needs --plain/);
});

test('the password is asked for where no file has it', async () => {
  const asks = (typed) => {
    const child = spawn(join(process.env.MILLRACE_BIN, 'millrace'), ['controller', 'add-route', '127.0.0.1', '--net-id', '10.0.0.8.1.1',
      '--user', 'Administrator', '--plain', '--port', `${cnc.discoveryPort}`], { stdio: ['pipe', 'ignore', 'ignore'] });
    child.stdin.end(typed);
    return new Promise((resolve) => child.once('close', resolve));
  };
  assert.equal(await asks('2\n'), 1);
  assert.equal(await asks('1\n'), 0);
});

test('the command adds a route over Secure ADS, and prints what the gateway needs', async () => {
  const [{ fingerprint }] = JSON.parse((await millrace('controller', 'find', '--address', '127.0.0.1', '--port',
    `${cnc.discoveryPort}`, '--json')).output);
  const unconfirmed = await addRoute('--self-signed', folder, '--port', `${cnc.securePort}`);
  assert.equal(unconfirmed.code, 1);
  assert.ok(unconfirmed.output.includes(fingerprint), unconfirmed.output);
  assert.match(unconfirmed.errors, /the fingerprint was not confirmed/);
  assert.equal(statSync(join(folder, 'millrace.key')).mode & 0o007, 0, 'the key is secret');

  const wrong = await addRoute('--self-signed', folder, '--port', `${cnc.securePort}`, '--fingerprint', '00'.repeat(32));
  assert.match(wrong.errors, /no route was added: its certificate has the fingerprint/);

  const added = await addRoute('--self-signed', folder, '--port', `${cnc.securePort}`, '--fingerprint', fingerprint);
  assert.equal(added.code, 0, added.errors);
  const block = added.output.slice(added.output.indexOf('machine {'));
  const config = join(folder, 'gateway.textproto');
  writeFileSync(config, block.replace('name: "…"', `name: "press" port: ${cnc.securePort}`).replace('net_id: "…"', 'net_id: "127.0.0.1.1.1"'));
  const read = await millrace('vars', 'press', 'read', 'V.G.BLOCK_NR', '--direct', '--config', config);
  assert.equal(read.code, 0, read.errors);
  assert.match(read.output, /V\.G\.BLOCK_NR/);
});
