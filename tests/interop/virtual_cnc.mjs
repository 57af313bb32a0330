// Starts a real millrace-cnc on a free port for one test file and ends it by its process id.
import { spawn } from 'node:child_process';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

const bin = process.env.MILLRACE_BIN;
if (!bin) {
  throw new Error('MILLRACE_BIN must name the folder of the built programs');
}

/** How long a test waits for a condition, in ms: far more than it takes on a busy host. */
export const limit = 30_000;

/** tests/data */
export const testData = process.env.MILLRACE_TEST_DATA;

/** The same with the text of its configuration file. */
export async function startConfiguredCnc(config) {
  const dir = mkdtempSync(join(tmpdir(), 'millrace-interop-'));
  const file = join(dir, 'cnc.textproto');
  writeFileSync(file, config);
  const cnc = await startVirtualCnc('--config', file);
  return { ...cnc, stop: () => cnc.stop().then(() => rmSync(dir, { recursive: true })) };
}

/**
 * Resolves, once the program has said that it is ready, with its ports, of plain and of Secure ADS, and a function that
 * ends it.
 */
export function startVirtualCnc(...flags) {
  const dir = mkdtempSync(join(tmpdir(), 'millrace-interop-'));
  const child = spawn(join(bin, 'millrace-cnc'), ['--listen', '127.0.0.1:0', '--dir', dir, ...flags], {
    stdio: ['ignore', 'pipe', 'inherit'],
  });
  const stop = async () => {
    if (child.exitCode === null) {
      const ended = new Promise((resolve) => child.once('exit', resolve));
      child.kill('SIGTERM');
      await ended;
    }
    rmSync(dir, { recursive: true });
  };
  return new Promise((resolve, reject) => {
    let output = '';
    child.once('exit', (code) => reject(new Error(`millrace-cnc ended with ${code} before it was ready`)));
    child.stdout.on('data', (chunk) => {
      output += chunk;
      const ready = output.match(/^ready: (?:.* on 127\.0\.0\.1:(\d+))?(?:.*, Secure ADS at 127\.0\.0\.1:(\d+))?(?:.*, discovery at 127\.0\.0\.1:(\d+))?.*$/m);
      if (ready) {
        resolve({ port: Number(ready[1]), securePort: Number(ready[2]), discoveryPort: Number(ready[3]), stop });
      }
    });
  });
}

/** The settings with which ads-client talks to a peer that is no TwinCAT router (one TCP connection, no symbols). */
export function adsClientSettings(port, adsPort) {
  return {
    routerAddress: '127.0.0.1',
    routerTcpPort: port,
    targetAmsNetId: '127.0.0.1.1.1',
    targetAdsPort: adsPort,
    localAmsNetId: '127.0.0.1.2.1',
    localAdsPort: 32750,
    rawClient: true,
    autoReconnect: false,
    timeoutDelay: limit,
  };
}
