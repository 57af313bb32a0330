// ADS clients that use names only: npm ads-client with its default settings reads, writes and
// subscribes to values by name, and lists symbols and data types; node-ads lists them too.
import assert from 'node:assert/strict';
import { writeFileSync, mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { Client } from 'ads-client';
import ads from 'node-ads';
import { adsClientSettings, limit, startVirtualCnc } from './virtual_cnc.mjs';

const sda = 552;

let folder;
let cnc;
let client;

before(async () => {
  folder = mkdtempSync(join(tmpdir(), 'millrace-by-name-'));
  const config = join(folder, 'cnc.textproto');
  writeFileSync(config, `
    channels: 2
    external_variable { name: "TABLE" type: SGN16 scope: GLOBAL array_elements: 3 }
    variable { name: "V.G.TOOL" type: STRING characters: 20 value: "drill" access: READ_WRITE }
    system_data { name: "COUNTS" type: SGN32 elements: 4 }
    system_data { name: "CONTROL" member { name: "LastFilled" type: SGN32 } member { name: "NOTE" type: STRING characters: 10 } }
  `);
  cnc = await startVirtualCnc('--config', config);
  client = new Client({ ...adsClientSettings(cnc.port, sda), rawClient: false });
  await client.connect();
});

after(async () => {
  await client?.disconnect();
  await cnc?.stop();
  rmSync(folder, { recursive: true });
});

test('a client connects that asks the system service for its state and the port for its symbols', () => {
  assert.equal(client.metaData.tcSystemState.adsStateStr, 'Run');
  assert.equal(client.metaData.plcRuntimeState.adsStateStr, 'Run');
  assert.equal(client.metaData.plcSymbolVersion, 1);
  assert.ok(client.metaData.plcUploadInfo.symbolCount > 50);
});

const values = [
  { name: 'CH[1].V.G.SERVICE.REQUEST_STATE', type: 'UDINT', value: 0, written: 4294967295 },
  { name: 'CH[2].V.G.SERVICE.RESPONSE', type: 'STRING(127)', value: '', written: 'fünf µm' },
  { name: 'CH[1].V.G.TOOL', type: 'STRING(20)', value: 'drill', written: '12345678901234567890' },
  { name: 'CH[1].V.E.TABLE', type: 'INT', value: [0, 0, 0], written: [1, -2, 3] },
  { name: 'SD.COUNTS', type: 'DINT', value: [0, 0, 0, 0], written: [1, 2, 3, -4] },
  { name: 'SD.COUNTS[2]', type: 'DINT', value: 2, written: 9 },
  {
    name: 'SD.CONTROL', type: 'SD_CONTROL', value: { LastFilled: 0, NOTE: '' },
    written: { LastFilled: 7, NOTE: 'seven' },
  },
  { name: 'SD.CONTROL.NOTE', type: 'STRING(10)', value: 'seven', written: 'eight' },
];
for (const { name, type, value, written } of values) {
  test(`${name} is read and written by its name`, async () => {
    const before = await client.readValue(name);
    assert.equal(before.dataType.type, type);
    assert.deepEqual(before.value, value);
    await client.writeValue(name, written);
    assert.deepEqual((await client.readValue(name)).value, written);
  });
}

test('values of the other ports are read by name', async () => {
  const read = async (name, adsPort) => (await client.readValue(name, { adsPort })).value;
  assert.equal(await read('cnc_version_r', 553), 'millrace virtual CNC');
  assert.equal(await read('CH[1].mode', 551), 1);
  assert.equal(await read('CH[1].AX[2].NAME', 553), 'Y');
  assert.equal(await read('CH[1].path velocity', 551), 0);
});

test('a value is watched by its name', async () => {
  const name = 'CH[1].V.G.SERVICE.RESPONSE_STATE';
  const seen = [];
  const changed = new Promise((resolve) => {
    client.subscribeValue(name, ({ value }) => {
      seen.push(value);
      if (value === 12345) {
        resolve();
      }
    }, 1).then(() => client.writeValue(name, 12345));
  });
  await changed;
  assert.deepEqual(seen, [0, 12345]);
});

test('an unknown name is refused as such', async () => {
  await assert.rejects(client.readValue('CH[3].V.G.SERVICE.UUID'), /symbol/i);
  await assert.rejects(client.getDataType('NO_SUCH_TYPE'), /NO_SUCH_TYPE failed/);
});

test('symbols are listed, each where its name leads', async () => {
  for (const adsPort of [551, 552, 553]) {
    const symbols = Object.values(await client.getSymbols({ adsPort }));
    const info = await client.readPlcUploadInfo({ adsPort });
    assert.equal(symbols.length, info.symbolCount);
    for (const symbol of symbols) {
      const alone = await client.getSymbol(symbol.name, { adsPort });
      // The field that ads-client names `reserved` is the beginning of the next symbol.
      assert.deepEqual({ ...alone, reserved: null }, { ...symbol, reserved: null }, symbol.name);
    }
  }
});

test('data types are listed, each as its name tells', async () => {
  const types = await client.getDataTypes(true);
  assert.deepEqual(Object.keys(types).filter((name) => name.startsWith('sd_')), ['sd_control']);
  for (const name of ['udint', 'lreal', 'string(127)', 'array [0..2] of int', 'array [1..4] of dint']) {
    assert.ok(types[name], `${name} among ${Object.keys(types)}`);
  }
  const symbols = Object.values(await client.getSymbols());
  for (const symbol of symbols) {
    assert.ok(types[symbol.type.toLowerCase()], symbol.type);
  }
});

test('node-ads lists symbols and data types', async () => {
  const other = await new Promise((resolve, reject) => {
    const one = ads.connect(
      {
        host: '127.0.0.1', port: cnc.port, amsNetIdTarget: '127.0.0.1.1.1', amsNetIdSource: '127.0.0.1.3.1',
        amsPortTarget: sda, timeout: limit,
      },
      function connected() {
        resolve(this);
      });
    one.on('error', reject);
  });
  const call = (method) => new Promise((resolve, reject) =>
    other[method]((error, result) => (error ? reject(new Error(error)) : resolve(result))));
  const symbols = await call('getSymbols');
  assert.equal(symbols.find((one) => one.name === 'CH[2].V.G.SERVICE.UUID').type, 'STRING(127)');
  assert.equal(symbols.filter((one) => one.name.startsWith('SD.COUNTS[')).length, 4);
  const control = (await call('getDatatyps')).find((one) => one.name === 'SD_CONTROL');
  assert.deepEqual(control.datatyps.map((item) => [item.name, item.type, item.offs, item.size]),
    [['LastFilled', 'DINT', 0, 4], ['NOTE', 'STRING(10)', 4, 11]]);
  await new Promise((resolve) => other.end(resolve));
});
