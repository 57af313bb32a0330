// A foreign controller for our client: openssl s_server does the TLS, this file answers inside it.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { createHash } from 'node:crypto';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { connect, createServer } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, test } from 'node:test';

const folder = mkdtempSync(join(tmpdir(), 'millrace-secure-controller-'));
after(() => rmSync(folder, { recursive: true }));

const freePort = () => new Promise((resolve) => {
  const server = createServer().listen(0, '127.0.0.1', () => {
    const { port } = server.address();
    server.close(() => resolve(port));
  });
});

const listens = (port) => new Promise((resolve) => {
  const socket = connect(port, '127.0.0.1', () => resolve(socket.destroy() && true));
  socket.once('error', () => resolve(false));
});

/** openssl s_server, which knows no ADS. What its client says first is `hello`; each request behind it is in `requests`. */
class Controller {
  constructor(port, ...flags) {
    this.port = port;
    this.hello = undefined;
    this.requests = [];
    this.errors = '';
    this.received = Buffer.alloc(0);
    this.child = spawn('openssl', ['s_server', '-accept', `127.0.0.1:${port}`, '-tls1_2', '-quiet', ...flags]);
    this.child.stdout.on('data', (chunk) => this.react(chunk));
    this.child.stderr.on('data', (chunk) => (this.errors += chunk));
    this.child.stdin.on('error', () => {});
  }

  static async start(...flags) {
    const controller = new Controller(await freePort(), ...flags);
    while (!await listens(controller.port)) {
      assert.equal(controller.child.exitCode, null, controller.errors);
    }
    return controller;
  }

  react(chunk) {
    this.received = Buffer.concat([this.received, chunk]);
    if (!this.hello) {
      if (this.received.length < 64) {
        return;
      }
      this.hello = this.take(64);
      const answer = Buffer.alloc(64);
      answer.writeUInt16LE(64, 0);
      answer.writeUInt16LE(1, 2);
      answer.writeUInt8(1, 4);
      Buffer.from([127, 0, 0, 1, 1, 1]).copy(answer, 6);
      this.child.stdin.write(answer);
    }
    while (this.received.length >= 32 && this.received.length >= 32 + this.received.readUInt32LE(20)) {
      const request = this.take(32 + this.received.readUInt32LE(20));
      this.requests.push(request);
      this.child.stdin.write(this.answer(request));
    }
  }

  take(size) {
    const bytes = this.received.subarray(0, size);
    this.received = this.received.subarray(size);
    return bytes;
  }

  /** ReadState: it runs. Everything else: 0x702, invalid group. */
  answer(request) {
    const command = request.readUInt16LE(16);
    const data = command === 4 ? Buffer.from([0, 0, 0, 0, 5, 0, 0, 0]) : Buffer.from([2, 7, 0, 0, 0, 0, 0, 0]);
    const header = Buffer.from(request.subarray(0, 32));
    request.copy(header, 0, 8, 16);
    request.copy(header, 8, 0, 8);
    header.writeUInt16LE(5, 18);
    header.writeUInt32LE(data.length, 20);
    return Buffer.concat([header, data]);
  }

  async stop() {
    const ended = new Promise((resolve) => this.child.once('close', resolve));
    this.child.kill('SIGKILL');
    await ended;
  }
}

/** What `millrace vars` says on standard error when it reads a variable of the controller at `port`. */
function readVariable(port, secure) {
  const file = join(folder, 'gateway.textproto');
  writeFileSync(file, `machine { name: "press" host: "127.0.0.1" port: ${port} net_id: "127.0.0.1.1.1" secure { ${secure} } }`);
  const child = spawn(join(process.env.MILLRACE_BIN, 'millrace'), ['vars', 'press', 'read', 'V.G.BLOCK_NR', '--direct', '--config', file]);
  let errors = '';
  child.stderr.on('data', (chunk) => (errors += chunk));
  return new Promise((resolve) => child.once('close', () => resolve(errors)));
}

function secret(name, text) {
  writeFileSync(join(folder, name), text, { mode: 0o600 });
}

const key = (password) => createHash('sha256').update(`MILLRACE${password}`).digest('hex');
const psk = 'psk { identity: "millrace" password_file: "press.psk" }';

function certificate(name) {
  const files = { certificate: join(folder, `${name}.crt`), key: join(folder, `${name}.key`) };
  execFileSync('openssl', ['req', '-x509', '-newkey', 'rsa:2048', '-nodes', '-keyout', files.key, '-out', files.certificate,
    '-days', '1', '-subj', `/CN=${name}`], { stdio: 'ignore' });
  return files;
}

function assertSpeaks(controller, flags, said) {
  assert.equal(controller.hello?.length, 64, said + controller.errors);
  assert.equal(controller.hello.readUInt16LE(0), 64);
  assert.equal(controller.hello.readUInt16LE(2), flags);
  assert.equal(controller.hello.readUInt8(4), 1);
  assert.deepEqual([...controller.hello.subarray(6, 12)], [127, 0, 0, 1, 2, 1]);
  assert.equal(controller.requests[0].readUInt16LE(16), 4, 'ReadState comes first');
  assert.ok(controller.requests.length > 1, said);
  assert.match(said, /0x702/);
}

test('a pre-shared key', async () => {
  secret('press.psk', 'secret\n');
  const controller = await Controller.start('-psk', key('secret'), '-nocert', '-cipher', 'PSK-AES256-CBC-SHA384');
  const said = await readVariable(controller.port, psk);
  assertSpeaks(controller, 0, said);
  await controller.stop();
});

test('another key', async () => {
  secret('press.psk', 'secret\n');
  const controller = await Controller.start('-psk', key('another'), '-nocert', '-cipher', 'PSK-AES256-CBC-SHA384');
  assert.match(await readVariable(controller.port, psk), /the pre-shared key of identity "millrace" is not the controller's/);
  assert.equal(controller.hello, undefined, 'nothing is said to it');
  await controller.stop();
});

test('a controller without these suites', async () => {
  secret('press.psk', 'secret\n');
  const controller = await Controller.start('-psk', key('secret'), '-nocert', '-cipher', 'PSK-AES256-GCM-SHA384');
  assert.match(await readVariable(controller.port, psk), /no cipher suite for a pre-shared key/);
  await controller.stop();
});

/** The hello of a TLS client: its session, and the numbers of its suites and of its extensions. */
function readHello(record) {
  const take = (at, width) => [at + width + record.readUIntBE(at, width), record.subarray(at + width, at + width + record.readUIntBE(at, width))];
  const numbers = (bytes) => Array.from({ length: bytes.length / 2 }, (_, i) => bytes.readUInt16BE(2 * i));
  const [suitesAt, session] = take(5 + 4 + 2 + 32, 1);
  const [compressionAt, suites] = take(suitesAt, 2);
  const [extensionsAt] = take(compressionAt, 1);
  const extensions = [];
  let [, rest] = take(extensionsAt, 2);
  for (; rest.length > 0; rest = rest.subarray(4 + rest.readUInt16BE(2))) {
    extensions.push(rest.readUInt16BE(0));
  }
  return { session, suites: numbers(suites), extensions };
}

test('a client asks for no session of before, and for nothing that a TwinCAT refuses', async () => {
  secret('press.psk', 'secret\n');
  const hellos = [];
  const server = createServer((socket) => {
    socket.once('data', (record) => {
      hellos.push(readHello(record));
      socket.destroy();
    });
    socket.on('error', () => {});
  });
  const port = await freePort();
  await new Promise((resolve) => server.listen(port, '127.0.0.1', resolve));
  await readVariable(port, psk);
  server.close();
  const [{ session, suites, extensions }] = hellos;
  assert.equal(session.length, 0);
  const renegotiation = 0xff;
  assert.deepEqual(suites.filter((suite) => suite !== renegotiation).sort(), [0x008c, 0x008d, 0x00ae, 0x00af], 'PSK with CBC alone');
  for (const [name, number] of Object.entries({ serverName: 0, encryptThenMac: 22, extendedMasterSecret: 23, sessionTicket: 35 })) {
    assert.ok(!extensions.includes(number), name);
  }
});

test('certificates that sign themselves', async () => {
  const [theirs, ours] = ['CX-123456', 'gateway'].map(certificate);
  const fingerprint = execFileSync('openssl', ['x509', '-in', theirs.certificate, '-noout', '-fingerprint', '-sha256'])
    .toString().trim().replace(/.*=/, '');
  const secure = (expected) => `self_signed { certificate: "${ours.certificate}" key: "${ours.key}" fingerprint: "${expected}" }`;
  const controller = await Controller.start('-cert', theirs.certificate, '-key', theirs.key, '-Verify', '1',
    '-CAfile', ours.certificate, '-verify_return_error');
  const refused = await readVariable(controller.port, secure('00'.repeat(32)));
  assert.match(refused, new RegExp(`has the fingerprint ${fingerprint}; expected 00:00:`));
  assert.equal(controller.hello, undefined, 'nothing is said to it');
  const said = await readVariable(controller.port, secure(fingerprint));
  assertSpeaks(controller, 0x10, said);
  await controller.stop();
});

test('certificates of one authority', async () => {
  const [ca, other] = ['plant', 'other'].map(certificate);
  const issue = (name) => {
    const [request, issued, file] = ['csr', 'crt', 'key'].map((ending) => join(folder, `${name}-plant.${ending}`));
    execFileSync('openssl', ['req', '-new', '-newkey', 'rsa:2048', '-nodes', '-keyout', file, '-out', request, '-subj', `/CN=${name}`],
      { stdio: 'ignore' });
    execFileSync('openssl', ['x509', '-req', '-in', request, '-CA', ca.certificate, '-CAkey', ca.key, '-out', issued, '-days', '1'],
      { stdio: 'ignore' });
    return { certificate: issued, key: file };
  };
  const [theirs, ours] = ['CX-123456', 'gateway'].map(issue);
  const secure = (authority, name) => `shared_ca { ca: "${authority}" certificate: "${ours.certificate}" key: "${ours.key}" common_name: "${name}" }`;
  const controller = await Controller.start('-cert', theirs.certificate, '-key', theirs.key, '-Verify', '1',
    '-CAfile', ca.certificate, '-verify_return_error');
  assert.match(await readVariable(controller.port, secure(other.certificate, 'CX-123456')), /does not lead to our CA/);
  assert.match(await readVariable(controller.port, secure(ca.certificate, 'CX-1')), /is that of "CX-123456"; expected "CX-1"/);
  assert.equal(controller.hello, undefined, 'nothing is said to it');
  assertSpeaks(controller, 0, await readVariable(controller.port, secure(ca.certificate, 'CX-123456')));
  await controller.stop();
});
