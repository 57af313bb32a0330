// Secure ADS, tested with openssl s_client: TLS is foreign here, and the content is hand-made, by
// the table of kevinherron/beckhoff-secure-ads.
import assert from 'node:assert/strict';
import { execFileSync, spawn } from 'node:child_process';
import { createHash } from 'node:crypto';
import { mkdtempSync, readFileSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { startConfiguredCnc } from './virtual_cnc.mjs';

const ours = [127, 0, 0, 1, 2, 1];
const controller = [127, 0, 0, 1, 1, 1];

/** A TlsConnectInfo. */
function hello({ flags = 0, version = 1, netId = ours, user = '', password = '' } = {}) {
  const bytes = Buffer.concat([Buffer.alloc(64), Buffer.from(user, 'latin1'), Buffer.from(password, 'latin1')]);
  bytes.writeUInt16LE(bytes.length, 0);
  bytes.writeUInt8(user.length, 12);
  bytes.writeUInt8(password.length, 13);
  bytes.writeUInt16LE(flags, 2);
  bytes.writeUInt8(version, 4);
  Buffer.from(netId).copy(bytes, 6);
  bytes.write('GATEWAY', 32, 'latin1');
  return bytes;
}

/** A request to the task SDA, without the AMS/TCP header. */
function request(command, data = Buffer.alloc(0), netId = ours) {
  const header = Buffer.alloc(32);
  Buffer.from(controller).copy(header, 0);
  header.writeUInt16LE(552, 6);
  Buffer.from(netId).copy(header, 8);
  header.writeUInt16LE(32750, 14);
  header.writeUInt16LE(command, 16);
  header.writeUInt16LE(4, 18);
  header.writeUInt32LE(data.length, 20);
  header.writeUInt32LE(7, 28);
  return Buffer.concat([header, data]);
}

/** REQUEST_STATE of the first channel, by its name. */
function readRequestState() {
  const name = Buffer.from('V.G.SERVICE.REQUEST_STATE\0', 'latin1');
  const data = Buffer.alloc(16);
  data.writeUInt32LE(0x122301, 0);
  data.writeUInt32LE(0x48, 4);
  data.writeUInt32LE(4, 8);
  data.writeUInt32LE(name.length, 12);
  return request(9, Buffer.concat([data, name]));
}

/** openssl s_client: what it sends and receives travels inside TLS. */
class Client {
  constructor(port, ...flags) {
    this.received = Buffer.alloc(0);
    this.errors = '';
    this.child = spawn('openssl', ['s_client', '-connect', `127.0.0.1:${port}`, '-tls1_2', '-quiet', '-nocommands', ...flags]);
    this.changed = () => {};
    this.child.stdin.on('error', () => {});
    this.child.stdout.on('data', (chunk) => {
      this.received = Buffer.concat([this.received, chunk]);
      this.changed();
    });
    this.child.stderr.on('data', (chunk) => (this.errors += chunk));
    this.ended = new Promise((resolve) => this.child.once('close', () => {
      this.over = true;
      this.changed();
      resolve();
    }));
  }

  send(...parts) {
    this.child.stdin.write(Buffer.concat(parts));
  }

  /** The next bytes; fewer if the connection ends before. */
  async receive(size) {
    while (this.received.length < size && !this.over) {
      await new Promise((resolve) => (this.changed = resolve));
    }
    const bytes = this.received.subarray(0, size);
    this.received = this.received.subarray(size);
    return bytes;
  }

  async close() {
    this.child.kill('SIGKILL');
    await this.ended;
  }
}

const key = (identity, password) => createHash('sha256').update(identity.toUpperCase() + password).digest('hex');
const withKey = (identity, password, suite = 'PSK-AES256-CBC-SHA384') => [
  '-psk_identity', identity, '-psk', key(identity, password), '-cipher', suite];

/** What openssl req makes of it: a certificate that signs itself, and its key. */
function selfSigned(name) {
  const [certificate, key] = [join(folder, `${name}.crt`), join(folder, `${name}.key`)];
  execFileSync('openssl', ['req', '-x509', '-newkey', 'rsa:2048', '-nodes', '-keyout', key, '-out', certificate,
    '-days', '1', '-subj', `/CN=${name}`], { stdio: 'ignore' });
  return { certificate, key };
}
const withCertificate = ({ certificate, key }, suite = 'DHE-RSA-AES256-GCM-SHA384') => [
  '-cert', certificate, '-key', key, '-cipher', suite];

const folder = mkdtempSync(join(tmpdir(), 'millrace-secure-ads-'));
after(() => rmSync(folder, { recursive: true }));

let cnc;

before(async () => {
  cnc = await startConfiguredCnc(
    'secure_ads { listen: "127.0.0.1:0" only: true psk { identity: "millrace" password: "secret" } }');
});

after(async () => {
  await cnc?.stop();
});

test('a client with the key is welcomed and asks as ever, without the AMS/TCP header', async () => {
  const sut = new Client(cnc.securePort, ...withKey('millrace', 'secret'));
  sut.send(hello());
  const answer = await sut.receive(64);
  assert.equal(answer.length, 64, sut.errors);
  assert.equal(answer.readUInt16LE(0), 64);
  assert.equal(answer.readUInt16LE(2) & 1, 1, 'a response');
  assert.equal(answer.readUInt8(5), 0, 'no error');
  assert.deepEqual([...answer.subarray(6, 12)], controller);

  sut.send(request(4));
  const state = await sut.receive(40);
  assert.deepEqual([...state.subarray(0, 6)], ours);
  assert.equal(state.readUInt16LE(18), 5, 'a response');
  assert.equal(state.readUInt32LE(20), 8);
  assert.equal(state.readUInt16LE(36), 5, 'it runs');

  sut.send(readRequestState());
  const value = await sut.receive(44);
  assert.equal(value.readUInt32LE(32), 0, 'no error');
  assert.equal(value.readUInt32LE(36), 4);
  assert.equal(value.readUInt32LE(40), 0, 'no request');
  await sut.close();
});

for (const suite of ['PSK-AES128-CBC-SHA256', 'PSK-AES256-CBC-SHA', 'PSK-AES128-CBC-SHA']) {
  test(`the suite ${suite} is there, too`, async () => {
    const sut = new Client(cnc.securePort, ...withKey('millrace', 'secret', suite));
    sut.send(hello());
    assert.equal((await sut.receive(64)).length, 64, sut.errors);
    await sut.close();
  });
}

test('suites that a TwinCAT refuses are refused', async () => {
  for (const suite of ['PSK-AES256-GCM-SHA384', 'ECDHE-PSK-AES256-CBC-SHA384', 'DHE-PSK-AES256-CBC-SHA384']) {
    const sut = new Client(cnc.securePort, ...withKey('millrace', 'secret', suite));
    await sut.ended;
    assert.match(sut.errors, /handshake failure/, suite);
  }
});

test('a wrong key gets an alert', async () => {
  const sut = new Client(cnc.securePort, ...withKey('millrace', 'wrong'));
  await sut.ended;
  assert.match(sut.errors, /bad record mac|decrypt error/);
});

test('an unknown identity gets an alert', async () => {
  const sut = new Client(cnc.securePort, ...withKey('stranger', 'secret'));
  await sut.ended;
  assert.match(sut.errors, /unknown psk identity/);
});

test('no session is resumed', () => {
  const said = execFileSync('openssl', ['s_client', '-connect', `127.0.0.1:${cnc.securePort}`, '-tls1_2', '-reconnect',
    ...withKey('millrace', 'secret')], { input: '', stdio: ['pipe', 'pipe', 'ignore'] }).toString();
  assert.ok(said.match(/^New, TLSv1\.\d, Cipher is PSK/mg)?.length > 1, said);
  assert.doesNotMatch(said, /^Reused/m);
});

test('another version of TlsConnectInfo gets error 1, and the connection ends', async () => {
  const sut = new Client(cnc.securePort, ...withKey('millrace', 'secret'));
  sut.send(hello({ version: 2 }));
  assert.equal((await sut.receive(64)).readUInt8(5), 1);
  await sut.ended;
});

test('frames behind the AMS/TCP header end the connection', async () => {
  const sut = new Client(cnc.securePort, ...withKey('millrace', 'secret'));
  const header = Buffer.from([0, 0, 32, 0, 0, 0]);
  sut.send(hello(), header, request(4));
  assert.equal((await sut.receive(64)).readUInt8(5), 0);
  await sut.ended;
  assert.equal(sut.received.length, 0);
});

test('a client that speaks for another NetId than it said loses its connection', async () => {
  const sut = new Client(cnc.securePort, ...withKey('millrace', 'secret'));
  sut.send(hello(), request(4, undefined, [10, 0, 0, 1, 1, 1]));
  assert.equal((await sut.receive(64)).readUInt8(5), 0);
  await sut.ended;
  assert.equal(sut.received.length, 0);
});

test('a client with a certificate of its own adds a route, and is known from then on', async () => {
  const [controllerFiles, gateway, stranger] = ['controller', 'gateway', 'stranger'].map(selfSigned);
  const routes = join(folder, 'routes');
  const config = `secure_ads { listen: "127.0.0.1:0" only: true routes_file: "${routes}"
    self_signed { certificate: "${controllerFiles.certificate}" key: "${controllerFiles.key}"
                  user: "Administrator" password: "1" } }`;
  const errorFor = async (files, how, suite) => {
    const sut = new Client(secured.securePort, ...withCertificate(files, suite));
    sut.send(hello(how), request(4));
    const answer = await sut.receive(64);
    assert.equal(answer.length, 64, sut.errors);
    const error = answer.readUInt8(5);
    const state = await sut.receive(40);
    assert.equal(state.length, error === 0 ? 40 : 0, 'frames are answered if there is no error');
    await sut.close();
    return error;
  };
  let secured = await startConfiguredCnc(config);
  const known = { flags: 0x10 };
  const adds = { flags: 0xf0, user: 'Administrator', password: '1' };
  assert.equal(await errorFor(gateway, known), 3, 'unknown');
  assert.equal(await errorFor(gateway, { ...adds, password: '2' }), 4, 'wrong password');
  assert.equal(await errorFor(gateway, adds), 0, 'added');
  assert.equal(await errorFor(gateway, known), 0, 'known');
  assert.equal(await errorFor(stranger, known), 3, 'another fingerprint');
  await secured.stop();

  const fingerprint = execFileSync('openssl', ['x509', '-in', gateway.certificate, '-noout', '-fingerprint', '-sha256'])
    .toString().trim().replace(/.*=/, '');
  assert.equal(readFileSync(routes, 'latin1'), `127.0.0.1.2.1 ${fingerprint}\n`);
  secured = await startConfiguredCnc(config);
  for (const suite of ['DHE-RSA-AES256-SHA256', 'DHE-RSA-AES128-SHA256', 'DHE-RSA-AES128-GCM-SHA256']) {
    assert.equal(await errorFor(gateway, known, suite), 0, `known after a restart, ${suite}`);
  }
  await secured.stop();
});

test('certificates have to be of the shared CA, valid, and of the host', async () => {
  const ca = selfSigned('plant');
  const other = selfSigned('other');
  const issue = (name, ...dates) => {
    const [request, certificate, key] = ['csr', 'crt', 'key'].map((ending) => join(folder, `${name}.${ending}`));
    execFileSync('openssl', ['req', '-new', '-newkey', 'rsa:2048', '-nodes', '-keyout', key, '-out', request,
      '-subj', `/CN=${name.split('-')[0]}`], { stdio: 'ignore' });
    execFileSync('openssl', ['x509', '-req', '-in', request, '-CA', ca.certificate, '-CAkey', ca.key, '-out', certificate,
      ...dates], { stdio: 'ignore' });
    return { certificate, key };
  };
  const [controllerFiles, gateway, expired, foreign] = [
    issue('controller'), issue('GATEWAY', '-days', '1'), issue('GATEWAY-expired', '-days', '-1'), issue('elsewhere')];
  const secured = await startConfiguredCnc(`secure_ads { listen: "127.0.0.1:0" only: true
    shared_ca { ca: "${ca.certificate}" certificate: "${controllerFiles.certificate}" key: "${controllerFiles.key}"
      client: "GATEWAY" } }`);
  const connect = (files) => new Client(secured.securePort, ...withCertificate(files), '-CAfile', ca.certificate, '-verify_return_error');

  let sut = connect(gateway);
  sut.send(hello(), request(4), readRequestState());
  assert.equal((await sut.receive(64)).readUInt8(5), 0, sut.errors);
  assert.equal((await sut.receive(40)).readUInt16LE(36), 5, 'it runs');
  assert.equal((await sut.receive(44)).length, 44);
  await sut.close();

  sut = connect(foreign);
  sut.send(hello());
  assert.equal((await sut.receive(64)).readUInt8(5), 2, 'the common name is not GATEWAY');
  await sut.ended;

  for (const [files, alert] of [[expired, /certificate expired/], [other, /unknown ca/]]) {
    sut = connect(files);
    await sut.ended;
    assert.match(sut.errors, alert);
  }
  await secured.stop();
});
