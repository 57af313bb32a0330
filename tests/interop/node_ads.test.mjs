// A second independent client: node-ads (npm), which was written from Beckhoff's protocol page
// alone.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import ads from 'node-ads';
import { limit, startVirtualCnc } from './virtual_cnc.mjs';

const decoder = 0x122301;
const geo = 551;
const com = 553;
const cnc_version = { indexGroup: 0x120100, indexOffset: 0x3, bytelength: ads.string(23), propname: 'value' };

let cnc;
const clients = [];

const connect = (amsPortTarget) =>
  new Promise((resolve, reject) => {
    const client = ads.connect(
      {
        host: '127.0.0.1',
        port: cnc.port,
        amsNetIdTarget: '127.0.0.1.1.1',
        amsNetIdSource: `127.0.0.1.3.${amsPortTarget - 550}`,
        amsPortTarget,
        timeout: limit,
      },
      function connected() {
        resolve(this);
      });
    client.on('error', reject);
    clients.push(client);
  });

// node-ads takes callbacks, and calls some of them with a client of its own as `this`.
const call = (client, method, ...args) =>
  new Promise((resolve, reject) =>
    client[method](...args, (error, result) => (error ? reject(new Error(error)) : resolve(result))));

before(async () => {
  cnc = await startVirtualCnc();
});

after(async () => {
  await Promise.all(clients.map((client) => new Promise((resolve) => client.end(resolve))));
  await cnc?.stop();
});

test('device info and state', async () => {
  const client = await connect(com);
  assert.match((await call(client, 'readDeviceInfo')).deviceName, /^millrace/);
  assert.equal((await call(client, 'readState')).adsState, 5);
});

test('a value is read and written by group and offset', async () => {
  const client = await connect(com);
  assert.equal((await call(client, 'read', { ...cnc_version })).value, 'millrace virtual CNC');
  const override = { indexGroup: 0x120101, bytelength: ads.WORD, propname: 'value' };
  await call(client, 'write', { ...override, indexOffset: 0x9, value: 750 });
  assert.equal((await call(client, 'read', { ...override, indexOffset: 0xa })).value, 750);
});

test('a variable of the Service Interface is read and written by name', async () => {
  const client = await connect(552);
  const name = Buffer.from('V.G.SERVICE.RESPONSE_STATE\0', 'latin1');
  const value = Buffer.from([0x39, 0x30, 0, 0]);
  await call(client, 'write', {
    indexGroup: decoder, indexOffset: 0x4a, bytelength: name.length + value.length, propname: 'value',
    value: Buffer.concat([name, value]),
  });
  const answer = await call(client, 'writeRead', {
    indexGroup: decoder, indexOffset: 0x48, readLength: 4, writeBuffer: name,
  });
  assert.equal(answer.readUInt32LE(), 12345);
});

test('a symbol is read and written by its name', async () => {
  const client = await connect(com);
  await call(client, 'write', {
    symname: 'CH[1].mc_command_block_ignore_w', bytelength: ads.DWORD, propname: 'value', value: 3,
  });
  const levels = await call(client, 'read', {
    symname: 'CH[1].mc_command_block_ignore_r', bytelength: ads.DWORD, propname: 'value',
  });
  assert.equal(levels.value, 3);
});

test('several symbols are read with one sum command, a wrong name among them', async () => {
  const client = await connect(com);
  const handles = await call(client, 'multiRead', [
    { symname: 'cnc_cycle_time_r', bytelength: ads.DWORD, propname: 'value' },
    { symname: 'no_such_object', bytelength: ads.DWORD, propname: 'value' },
    { symname: 'cnc_number_of_channel_r', bytelength: ads.WORD, propname: 'value' },
  ]);
  assert.equal(handles[0].value, 1000);
  assert.equal(handles[1].err, 0x710);
  assert.equal(handles[2].value, 1);
});

test('a notification brings the value, and then its changes', async () => {
  const client = await connect(geo);
  const operator = await connect(com);
  const seen = [];
  const mode = {
    indexGroup: 0x123301, indexOffset: 0x20, bytelength: ads.DWORD, propname: 'value',
    transmissionMode: ads.NOTIFY.ONCHANGE, maxDelay: 0, cycleTime: 1,
  };
  const changed = new Promise((resolve) => {
    client.on('notification', (handle) => {
      seen.push(handle.value);
      if (handle.value === 2) {
        resolve();
      }
    });
  });
  await call(client, 'notify', mode);
  await call(operator, 'write', {
    indexGroup: 0x120101, indexOffset: 0x104, bytelength: ads.DWORD, propname: 'value', value: 2,
  });
  await changed;
  // node-ads drops a sample that arrives before it has read its handle: the first value may be
  // missing.
  assert.deepEqual(seen.filter((value) => value !== 1), [2]);
  await new Promise((resolve) => client.releaseNotificationHandles(resolve));
});

test('an error has its code', async () => {
  const client = await connect(com);
  await assert.rejects(call(client, 'read', { ...cnc_version, indexOffset: 0x999 }), /703|1795|offset/i);
});
