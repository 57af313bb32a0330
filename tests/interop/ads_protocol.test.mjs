// Services of every ADS device other than single requests, used by an independent client (npm
// ads-client): sum commands, device notifications, and the errors of a router.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { Client } from 'ads-client';
import { adsClientSettings, startVirtualCnc } from './virtual_cnc.mjs';

const com = 553;
const platform = 0x120100;
const tickCounter = { indexGroup: platform, indexOffset: 0x1, size: 4 };
const version = { indexGroup: platform, indexOffset: 0x3, size: 24 };
const nothing = { indexGroup: 0x999999, indexOffset: 0x1, size: 10 };

let cnc;
let client;

before(async () => {
  cnc = await startVirtualCnc();
  client = new Client(adsClientSettings(cnc.port, com));
  await client.connect();
});

after(async () => {
  await client?.disconnect();
  await cnc?.stop();
});

// The values of the first notifications, and a function to end them.
const collect = async (target, count, sendOnChange, cycleTime) => {
  const values = [];
  let finish;
  const complete = new Promise((resolve) => (finish = resolve));
  const subscription = await client.subscribeRaw(
    target.indexGroup, target.indexOffset, target.size,
    (data) => {
      values.push(data);
      if (values.length === count) {
        finish();
      }
    },
    cycleTime, sendOnChange);
  await complete;
  return { values, subscription };
};

test('a sum read keeps the slot of an item that fails', async () => {
  const [first, failed, last] = await client.readRawMulti([tickCounter, nothing, version]);
  assert.ok(first.success);
  assert.ok(!failed.success);
  assert.equal(failed.errorCode, 0x702);
  assert.match(last.value.toString('latin1'), /^millrace/);
});

test('a sum of 500 items is answered', async () => {
  const items = await client.readRawMulti(Array.from({ length: 500 }, () => tickCounter));
  assert.equal(items.filter((item) => item.success).length, 500);
});

test('a sum of reads and writes packs what was returned', async () => {
  const read = (name, size) => ({
    indexGroup: 0x122301, indexOffset: 0x48, size, value: Buffer.from(`${name}\0`, 'latin1'),
  });
  const answers = await client.readWriteRawMulti(
    [read('V.G.SERVICE.REQUEST_STATE', 4), read('V.G.SERVICE.NONE', 4), read('V.G.SERVICE.UUID', 256)],
    { adsPort: 552 });
  assert.deepEqual(answers.map((answer) => answer.success), [true, false, true]);
  assert.equal(answers[0].data.length, 4);
  assert.equal(answers[1].errorCode, 0x710);
});

test('a sum write tells the result of each item', async () => {
  const write = (offset, value) => ({ indexGroup: 0x120101, indexOffset: offset, value: Buffer.from(value) });
  const results = await client.writeRawMulti([write(0x3f, [0, 0, 0, 0]), write(0x999, [0])]);
  assert.deepEqual(results.map((result) => result.success), [true, false]);
});

test('a cyclic notification comes each cycle with the time of its sample', async () => {
  const { values, subscription } = await collect(tickCounter, 10, false, 10);
  await subscription.unsubscribe();
  const ticks = values.map((data) => data.value.readUInt32LE());
  for (let i = 1; i < ticks.length; ++i) {
    assert.ok(ticks[i] > ticks[i - 1], `${ticks}`);
    assert.ok(values[i].timestamp >= values[i - 1].timestamp);
  }
  assert.ok(Math.abs(values[0].timestamp - Date.now()) < 60_000);
});

test('a notification on change comes once at the beginning', async () => {
  const { values, subscription } = await collect(version, 1, true, 1);
  await client.readState();
  await client.readState();
  await subscription.unsubscribe();
  assert.equal(values.length, 1);
});

test('a value that does not exist cannot be watched', async () => {
  await assert.rejects(client.subscribeRaw(nothing.indexGroup, 1, 4, () => {}, 10), (error) => {
    assert.equal(error.adsError?.errorCode, 0x702);
    return true;
  });
});

test('an AMS port that nobody serves is an error of the router', async () => {
  await assert.rejects(client.readRaw(platform, 0x1, 4, { adsPort: 999 }), (error) => {
    assert.match(JSON.stringify(error), /"errorCode":6/);
    return true;
  });
});
