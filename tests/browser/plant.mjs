// A plant of real processes for one test file, on free ports and in its own DDS domain, on the
// loopback interface: virtual CNCs, gateways, services, and `millrace web`.
//
//   const plant = await Plant.start();
//   await plant.cnc(); await plant.gateway(); const service = await plant.squareRoot();
//   const web = await plant.web();                       // web.url
//   await plant.stop();
import { execFile, spawn } from 'node:child_process';
import { chmodSync, mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { connect } from 'node:net';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { promisify } from 'node:util';

const bin = process.env.MILLRACE_BIN;
if (!bin) {
  throw new Error('MILLRACE_BIN must name the folder of the built programs');
}
const run = promisify(execFile);

export const squareRootUuid = '560aacbf-6335-44a9-895a-8b27f3ed5e47';
export const slowUuid = '3d5a2f8c-9b1e-4f06-8a7d-1c2e3f405162';

/** Waits until `condition` returns something true, which it resolves with. */
export async function until(condition, what, milliseconds = 60_000) {
  const end = Date.now() + milliseconds;
  for (;;) {
    const value = await condition();
    if (value) {
      return value;
    }
    if (Date.now() > end) {
      throw new Error(`${what} did not come to pass within ${milliseconds} ms`);
    }
    await new Promise((resolve) => setTimeout(resolve, 20));
  }
}

class Child {
  output = '';
  errors = '';

  constructor(program, flags) {
    this.child = spawn(join(bin, program), flags, { stdio: ['ignore', 'pipe', 'pipe'] });
    this.child.stdout.on('data', (chunk) => (this.output += chunk));
    this.child.stderr.on('data', (chunk) => (this.errors += chunk));
    this.ended = new Promise((resolve) => this.child.once('close', (code, signal) => resolve(code ?? signal)));
    this.name = `${program} ${flags.join(' ')}`;
  }

  get hasEnded() {
    return this.child.exitCode !== null || this.child.signalCode !== null;
  }

  async ready() {
    await until(() => {
      if (this.hasEnded) {
        throw new Error(`${this.name} ended before it was ready: ${this.errors}`);
      }
      return /^ready: /m.test(this.output);
    }, `"ready" of ${this.name}`);
    return this;
  }

  /** Ends it in order, or without a word with SIGKILL. */
  async stop(signal = 'SIGTERM') {
    if (!this.hasEnded) {
      this.child.kill(signal);
    }
    return this.ended;
  }
}

/** A DDS domain that no other test of this host has: the lock files are those of tests/support/domain.cpp. */
async function lockDomain() {
  for (let i = 0; i < 101; i += 1) {
    const domain = ((process.pid + i) % 101) + 1;
    const holder = spawn('flock', ['-n', join(tmpdir(), `millrace-test-domain-${domain}.lock`), 'sh', '-c', 'echo locked; cat'],
      { stdio: ['pipe', 'pipe', 'ignore'] });
    const locked = await new Promise((resolve) => {
      holder.stdout.once('data', () => resolve(true));
      holder.once('close', () => resolve(false));
    });
    if (locked) {
      return { domain, holder };
    }
  }
  throw new Error('no free DDS domain for a test: all lock files are held');
}

export class Plant {
  #children = [];
  #holder;

  static async start() {
    const plant = new Plant();
    plant.folder = mkdtempSync(join(tmpdir(), 'millrace-browser-'));
    const { domain, holder } = await lockDomain();
    plant.domain = domain;
    plant.#holder = holder;
    return plant;
  }

  #start(program, flags) {
    const child = new Child(program, flags);
    this.#children.push(child);
    return child;
  }

  #fabric() {
    return ['--domain', String(this.domain)];
  }

  /** A virtual CNC; its port is `cncPort` then. */
  async cnc(...flags) {
    const child = await this.#start('millrace-cnc', ['--listen', '127.0.0.1:0', '--dir', this.folder, '--channels', '3', ...flags]).ready();
    this.cncPort = Number(/ on 127\.0\.0\.1:(\d+)/.exec(child.output)[1]);
    return child;
  }

  gateway(...flags) {
    return this.#start('millrace-gateway', [...this.#fabric(), '--machine', `cnc=127.0.0.1:${this.cncPort}/127.0.0.1.1.1`,
      '--journal', join(this.folder, 'journal'), ...flags]).ready();
  }

  /** A gateway whose machine "cnc" has these parts of a configuration, too. */
  configuredGateway(parts) {
    const config = this.file('gateway.textproto', `machine { name: "cnc" host: "127.0.0.1" port: ${this.cncPort} net_id: "127.0.0.1.1.1" ${parts} }\n`);
    return this.#start('millrace-gateway', [...this.#fabric(), '--config', config, '--journal', join(this.folder, 'journal')]).ready();
  }

  squareRoot(...flags) {
    return this.#start('millrace-square-root', [...this.#fabric(), ...flags]).ready();
  }

  /** A service that answers with its request after `seconds`, unless it is ended before; at most once. */
  slowService({ seconds = 60, flags = [] } = {}) {
    const script = this.file(`answer-after-${seconds}`, `#!/bin/sh\nsleep ${seconds}\necho "$1"\n`);
    chmodSync(script, 0o755);
    return this.#start('millrace-batch', [...this.#fabric(), '--uuid', slowUuid, '--name', 'slow', '--time-limit', '90000', '--exec', script, ...flags]).ready();
  }

  /** `millrace web`; with `port` 0 on any that is free. */
  async web({ port = 0, flags = [] } = {}) {
    const child = await this.#start('millrace', ['web', ...this.#fabric(), '--listen', `127.0.0.1:${port}`, ...flags]).ready();
    child.url = /http:\/\/127\.0\.0\.1:\d+/.exec(child.output)[0];
    child.port = Number(child.url.split(':')[2]);
    return child;
  }

  /** Runs while the test goes on. */
  recorder(file) {
    return this.#start('millrace', ['record', ...this.#fabric(), '--output', file]);
  }

  /** Sends recorded data again while the test goes on. */
  replayData(file, ...flags) {
    return this.#start('millrace', ['replay', '--data', ...this.#fabric(), ...flags, file]);
  }

  /** The command, to its end: what it printed. */
  async millrace(...flags) {
    const { stdout } = await run(join(bin, 'millrace'), flags, { encoding: 'utf8' });
    return stdout;
  }

  #vars(channel, action, ...rest) {
    return this.millrace('vars', `cnc=127.0.0.1:${this.cncPort}/127.0.0.1.1.1`, action, '--direct', '--channel', String(channel), ...rest);
  }

  /** Writes a request into a channel, as an NC program does. */
  async request(channel, uuid, text, state = 1) {
    await this.#vars(channel, 'write', '--force', 'V.G.SERVICE.RESPONSE_STATE', '0');
    await this.#vars(channel, 'write', '--force', 'V.G.SERVICE.UUID', uuid);
    await this.#vars(channel, 'write', '--force', '--', 'V.G.SERVICE.REQUEST', text);
    await this.#vars(channel, 'write', '--force', 'V.G.SERVICE.REQUEST_STATE', String(state));
  }

  /** Writes a variable, as an operator does. */
  write(channel, name, value) {
    return this.#vars(channel, 'write', '--', name, value);
  }

  /** What an operator does at the panel of channel 1: automatic mode, this program, and off it goes. */
  async runProgram(name) {
    const number = (value) => Buffer.from([value, 0, 0, 0]);
    await this.#writeObject(0x104, number(2));
    await this.#writeObject(0x108, Buffer.from(`${name}\0`));
    await this.#writeObject(0x105, number(3));
    await this.#writeObject(0x105, number(4));
  }

  /** An ADS write to an object of the task COM, in a connection of its own. */
  async #writeObject(offset, data) {
    const frame = Buffer.alloc(6 + 32 + 12);
    frame.writeUInt32LE(32 + 12 + data.length, 2);
    frame.set([127, 0, 0, 1, 1, 1], 6);
    frame.writeUInt16LE(553, 12);
    frame.set([127, 0, 0, 1, 1, 2], 14);
    frame.writeUInt16LE(40000, 20);
    frame.writeUInt16LE(3, 22);
    frame.writeUInt16LE(4, 24);
    frame.writeUInt32LE(12 + data.length, 26);
    frame.writeUInt32LE(1, 34);
    frame.writeUInt32LE(0x120101, 38);
    frame.writeUInt32LE(offset, 42);
    frame.writeUInt32LE(data.length, 46);
    const socket = connect(this.cncPort, '127.0.0.1');
    const answer = await new Promise((resolve, reject) => {
      socket.once('error', reject);
      socket.once('data', resolve);
      socket.write(Buffer.concat([frame, data]));
    });
    socket.destroy();
    const errors = [answer.readUInt32LE(30), answer.length >= 42 ? answer.readUInt32LE(38) : 0];
    if (errors.some(Boolean)) {
      throw new Error(`the CNC answered ADS errors ${errors}`);
    }
  }

  /** Takes the request of a channel back. */
  withdraw(channel) {
    return this.#vars(channel, 'write', '--force', 'V.G.SERVICE.REQUEST_STATE', '0');
  }

  /** A file of --allow-actions with one user. */
  async users(name, password) {
    const child = execFile(join(bin, 'millrace'), ['web', '--hash-password']);
    let hash = '';
    child.stdout.on('data', (chunk) => (hash += chunk));
    child.stdin.end(`${password}\n`);
    await new Promise((resolve) => child.once('close', resolve));
    const file = join(this.folder, 'users.textproto');
    writeFileSync(file, `user { name: "${name}" password_hash: "${hash.trim()}" }\n`, { mode: 0o600 });
    return file;
  }

  /** A file of this test's own. */
  file(name, content) {
    const path = join(this.folder, name);
    if (content !== undefined) {
      writeFileSync(path, content);
    }
    return path;
  }

  async stop() {
    for (const child of this.#children.reverse()) {
      await child.stop();
    }
    this.#holder?.stdin.end();
    rmSync(this.folder, { recursive: true, force: true });
  }
}
