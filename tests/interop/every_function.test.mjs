// An independent ADS client (npm ads-client) tries every family of objects and every function of
// the virtual CNC: old and generic variable functions, axes, attributes, directory, channel state,
// program control, handles and symbols. A waiting program has one variable of each family.
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { Client } from 'ads-client';
import { adsClientSettings, limit, startVirtualCnc, testData } from './virtual_cnc.mjs';

const geo = 551;
const sda = 552;
const com = 553;
const decoder = 0x122301;
const oldDecoder = 0x22301;
const interpolator = 0x121301;
const channelState = 0x123301;
const command = 0x120101;

const name = (text) => Buffer.from(`${text}\0`, 'latin1');
const u32 = (...values) => Buffer.concat(values.map((value) => {
  const bytes = Buffer.alloc(4);
  bytes.writeUInt32LE(value);
  return bytes;
}));
const text = (bytes) => bytes.toString('latin1').split('\0')[0];

let cnc;
let client;

const read = (group, offset, size, port = sda) => client.readRaw(group, offset, size, { adsPort: port });
const ask = (group, offset, size, input, port = sda) =>
  client.readWriteRaw(group, offset, size, input, { adsPort: port });
const write = (group, offset, value, port = sda) => client.writeRaw(group, offset, value, { adsPort: port });
const number = async (...place) => (await read(...place)).readUInt32LE();
const refused = (code, call) =>
  assert.rejects(call, (error) => {
    assert.equal(Number(error.adsError?.errorCode), code, JSON.stringify(error));
    return true;
  });
const until = async (condition) => {
  for (const end = Date.now() + limit; Date.now() < end;) {
    if (await condition()) {
      return;
    }
  }
  assert.fail(`never true: ${condition}`);
};

before(async () => {
  const data = join(testData, 'nc/interop');
  cnc = await startVirtualCnc('--config', join(data, 'walk.cnc.textproto'), '--speed', '0',
    '--run', `1=${join(data, 'walk.nc')}`);
  client = new Client(adsClientSettings(cnc.port, sda));
  await client.connect();
  await until(async () => (await ask(decoder, 0x48, 8, name('V.A.ACT_POS.Y'))).readDoubleLE() === -20);
});

after(async () => {
  await client?.disconnect();
  await cnc?.stop();
});

// Offsets of a family of program variables: count, name by index, value by name, value by index.
const programFamilies = [
  { family: 'P', offsets: [0x02, 0x1b, 0x1c, 0x1d], variable: 'P12', value: 3.25 },
  { family: 'V.L', offsets: [0x03, 0x1e, 0x1f, 0x20], variable: 'V.L.HERE', value: 1.5 },
  { family: 'V.S', offsets: [0x05, 0x24, 0x25, 0x26], variable: 'V.S.KEPT', value: 9 },
];
for (const { family, offsets, variable, value } of programFamilies) {
  test(`old functions of ${family}: number, name, value by name and by index`, async () => {
    const [count, nameAt, byName, byIndex] = offsets;
    assert.equal(await number(decoder, count, 4), 1);
    assert.equal(text(await ask(decoder, nameAt, 96, u32(0))), variable);
    assert.equal((await ask(decoder, byName, 8, name(variable))).readDoubleLE(), value);
    assert.equal((await ask(decoder, byIndex, 8, u32(0))).readDoubleLE(), value);
    await refused(0x706, ask(decoder, byIndex, 8, u32(1)));
  });
}

test('old functions of V.P: an array shows its largest index', async () => {
  assert.equal(await number(decoder, 0x04, 4), 2);
  const names = [text(await ask(decoder, 0x21, 96, u32(0))), text(await ask(decoder, 0x21, 96, u32(1)))];
  assert.deepEqual(names, ['V.P.TABLE[1]', 'V.P.TEXT']);
  assert.equal((await ask(decoder, 0x22, 8, name('V.P.TABLE[1]'))).readDoubleLE(), -8);
});

test('old functions of V.E: everything about a variable', async () => {
  assert.equal(await number(decoder, 0x27, 4), 3);
  assert.equal(text(await ask(decoder, 0x29, 20, u32(1))), 'V.E.TABLE[2]');
  assert.equal((await ask(decoder, 0x28, 4, u32(1))).readUInt32LE(), 3);
  assert.equal(text(await ask(decoder, 0x2a, 20, u32(1))), 'V_SGN16');
  assert.equal((await ask(decoder, 0x2b, 4, u32(2))).readUInt32LE(), 1); // behind GO
  assert.equal(text(await ask(decoder, 0x2c, 20, u32(1))), 'GLOBAL');
  assert.equal((await ask(decoder, 0x2d, 4, u32(0))).readUInt32LE(), 1);
  assert.equal((await ask(decoder, 0x30, 4, u32(1))).readUInt32LE(), 6);
  const value = await ask(decoder, 0x2e, 24, u32(1));
  assert.equal(value.length, 24);
  await write(decoder, 0x4a, Buffer.concat([name('V.E.TABLE[2]'), Buffer.from([0xfe, 0xff])]));
  assert.equal((await ask(decoder, 0x2f, 24, name('V.E.TABLE[2]'))).readInt16LE(), -2);
});

test('old functions of V.A and the axes', async () => {
  const quantities = await number(decoder, 0x31, 4);
  const names = [];
  for (let i = 0; i < quantities; ++i) {
    names.push(text(await ask(decoder, 0x32, 96, u32(i))));
    assert.equal(text(await ask(decoder, 0x33, 96, u32(i))), 'V_REAL64');
    assert.equal(text(await ask(decoder, 0x34, 96, u32(i))), 'READ_ONLY');
  }
  assert.ok(names.includes('V.A.ACT_POS'), `${names}`);
  assert.equal((await ask(decoder, 0x37, 24, name('V.A.ACT_POS.X'))).readDoubleLE(), 10);
  const structure = Buffer.alloc(120);
  structure.write('V.A.ACT_POS.X', 'latin1');
  await refused(0x704, write(decoder, 0x38, structure));
  assert.equal(await number(decoder, 0x35, 4), 3);
  assert.equal(text(await ask(decoder, 0x36, 96, u32(2))), 'Z');
});

test('old functions of V.G: listed, read and written in S_WRITE_VAR_DATA', async () => {
  const count = await number(decoder, 0x39, 4);
  const names = [];
  for (let i = 0; i < count; ++i) {
    names.push(text(await ask(decoder, 0x3a, 96, u32(i))));
  }
  const state = names.indexOf('V.G.SERVICE.REQUEST_STATE');
  assert.ok(state >= 0, `${names}`);
  assert.equal(text(await ask(decoder, 0x3b, 96, u32(state))), 'V_UNS32');
  assert.equal(text(await ask(decoder, 0x3c, 96, u32(state))), 'READ_WRITE');
  assert.equal(text(await ask(decoder, 0x3d, 96, u32(state))), 'V_VALUE');
  const structure = Buffer.alloc(120);
  structure.write('V.G.SERVICE.REQUEST_STATE', 'latin1');
  structure.writeUInt32LE(77, 96);
  await write(decoder, 0x3f, structure);
  assert.equal((await ask(decoder, 0x3e, 24, name('V.G.SERVICE.REQUEST_STATE'))).readUInt32LE(), 77);
});

const families = ['V.E', 'V.G', 'V.A'];
test('generic functions: every variable of a kind is described, and read by its handle', async () => {
  let sum = 0;
  for (const kind of families) {
    const count = (await ask(decoder, 0x44, 4, name(kind))).readUInt32LE();
    sum += count;
    for (let i = 0; i < count; ++i) {
      const description = await ask(decoder, 0x45, 512, Buffer.concat([u32(i), name(kind)]));
      const [handle, type, , size, dimensions] = [0, 4, 8, 12, 16].map((at) => description.readUInt32LE(at));
      const variable = text(description.subarray(20 + 4 * dimensions));
      assert.ok(variable.startsWith(kind), variable);
      assert.ok(type >= 1 && type <= 9, variable);
      const same = (await ask(decoder, 0x46, 4, name(variable))).readUInt32LE();
      assert.equal(same, handle, variable);
      assert.equal((await ask(decoder, 0x47, 2048, u32(handle, 0))).length, size, variable);
      const byName = await ask(decoder, 0x4c, 512, name(variable));
      assert.deepEqual(byName, description.subarray(0, 20 + 4 * dimensions), variable);
    }
  }
  assert.equal((await ask(decoder, 0x44, 4, Buffer.alloc(0))).readUInt32LE(), sum);
});

test('generic functions: an element is written and read by handle and index', async () => {
  const handle = (await ask(decoder, 0x46, 4, name('V.E.TABLE'))).readUInt32LE();
  await write(decoder, 0x49, Buffer.concat([u32(handle, 1, 1), Buffer.from([5, 0])]));
  assert.equal((await ask(decoder, 0x47, 2, u32(handle, 1, 1))).readInt16LE(), 5);
  assert.equal((await ask(decoder, 0x48, 2, name('V.E.TABLE[1]'))).readInt16LE(), 5);
});

test('generic functions: synchronisation and scope of external variables', async () => {
  const extended = async (i) => ask(decoder, 0x4b, 8, Buffer.concat([u32(i), name('V.E')]));
  assert.deepEqual(await extended(0), u32(1, 1));
  assert.deepEqual(await extended(1), u32(2, 2));
});

for (const [variable, check] of [
  ['P12', (value) => value.readDoubleLE() === 3.25],
  ['V.P.TEXT', (value) => text(value) === 'part'],
  ['V.P.TABLE[1]', (value) => value.readInt16LE() === -8],
  ['V.L.HERE', (value) => value.readDoubleLE() === 1.5],
  ['V.S.KEPT', (value) => value.readUInt32LE() === 9],
  ['V.CYC.LEVEL', (value) => value.readDoubleLE() === 2],
]) {
  test(`generic functions: ${variable} is read by name`, async () => {
    const value = await ask(decoder, 0x48, 2048, name(variable));
    assert.ok(check(value), value.toString('hex'));
  });
}

test('functions of one axis: handle, read, and no write', async () => {
  const handle = await ask(decoder, 0x20004, 4, name('V.A.ACT_POS'));
  assert.deepEqual(await ask(decoder, 0x46, 4, name('V.A.ACT_POS.Y')), handle);
  assert.equal((await ask(decoder, 0x20005, 8, name('V.A.ACT_POS'))).readDoubleLE(), -20);
  await refused(0x704, write(decoder, 0x20006, Buffer.concat([name('V.A.ACT_POS'), Buffer.alloc(8)])));
});

test('both bases of the index groups are the same objects', async () => {
  assert.equal(await number(oldDecoder, 0x35, 4), await number(decoder, 0x35, 4));
  assert.deepEqual(await read(0x21301, 0x1, 2, geo), await read(interpolator, 0x1, 2, geo));
});

test('attributes of every object of the interpolator agree with its value', async () => {
  const last = await number(interpolator, 0, 4, geo);
  let found = 0;
  for (let offset = 1; offset <= last; ++offset) {
    const label = await read(interpolator + 0x100, offset, 64, geo).catch(() => null);
    if (label === null) {
      continue;
    }
    ++found;
    if (/ by (name|index)$/.test(text(label))) {
      // A question, not a value.
      await refused(0x704, read(interpolator, offset, 64, geo));
      continue;
    }
    const type = text(await read(interpolator + 0x200, offset, 16, geo));
    const length = await number(interpolator + 0x300, offset, 4, geo);
    assert.equal((await read(interpolator, offset, 64, geo)).length, length, text(label));
    assert.match(type, /^(UNS|SGN|REAL)(08|16|32|64)$/);
    await read(interpolator + 0x400, offset, 16, geo);
    assert.equal((await read(interpolator + 0x500, offset, 1, geo)).length, 1);
  }
  assert.ok(found >= 7, `${found} objects`);
  assert.deepEqual(await ask(0x121900, 0, 8, u32(1, 0), geo), u32(interpolator, 0));
});

test('every object of the directory is where the directory says', async () => {
  const count = await number(0x130100, 0, 4, com);
  const records = await read(0x130100, 1, 84 * count, com);
  assert.equal(records.length, 84 * count);
  for (let i = 0; i < count; ++i) {
    const record = records.subarray(84 * i, 84 * (i + 1));
    const [size, writable, group, offset] =
      [record.readUInt32LE(4), record.readUInt16LE(8), record.readUInt32LE(12), record.readUInt32LE(16)];
    const label = text(record.subarray(20, 52));
    if (writable) {
      await refused(0x705, write(group, offset, Buffer.alloc(size + 1), com));
    } else {
      assert.equal((await read(group, offset, size, com)).length, size, label);
    }
  }
});

test('axes are found as axes of the CNC and of their channel', async () => {
  const tenthsOfAMicrometre = 10_000;
  assert.equal((await read(0x120200, 0x20003, 4, com)).readInt32LE(), -20 * tenthsOfAMicrometre);
  assert.equal((await read(command, 0x20007, 4, com)).readInt32LE(), -20 * tenthsOfAMicrometre);
  assert.equal(text(await read(0x120200, 0x60009, 16, com)), 'Z');
  assert.equal((await read(0x120200, 0x6000f, 2, com)).readUInt16LE(), 2);
  assert.equal((await read(0x120300, 0x1000d, 4, geo)).readInt32LE(), 0);
});

test('handles and symbols: got, read, written and released, one by one and as sums', async () => {
  const port = { adsPort: com };
  const handle = await client.createVariableHandle('cnc_cycle_time_r', port);
  assert.equal(handle.size, 4);
  assert.equal((await client.readRawByHandle(handle, 4, port)).readUInt32LE(), 1000);
  await client.deleteVariableHandle(handle, port);
  await refused(0x710, client.readRawByHandle(handle, 4, port));
  const [first, missing] = await client.createVariableHandleMulti(['cnc_version_r', 'no_such_object'], port);
  assert.ok(first.success);
  assert.equal(missing.errorCode, 0x710);
  await client.deleteVariableHandleMulti([first.handle], port);
  assert.match(text(await client.readRawByPath('cnc_version_r', port)), /^millrace/);
  await client.writeRawByPath('CH[2].mc_command_feed_override_w', Buffer.from([0xf4, 0x01]), port);
  assert.equal((await client.readRawByPath('CH[2].mc_active_feed_override_r', port)).readUInt16LE(), 500);
});

test('the program ends, another one is chosen, single-stepped, streamed and reset over ADS', async () => {
  const state = () => number(channelState, 0x1f, 4, geo);
  const send = (offset, value) => write(command, offset, value, com);
  assert.equal(await state(), 4); // active
  await write(decoder, 0x4a, Buffer.concat([name('V.E.GO'), Buffer.from([1])]));
  await until(async () => (await state()) === 2); // selected
  await send(0x104, u32(3)); // MDI
  await send(0x108, name('N10 G00 X1\nN20 X2\nN30 #WAIT FOR FALSE'));
  await send(0x105, u32(3)); // ready
  assert.equal(await state(), 3);
  await send(0x1, Buffer.from([1]));
  await send(0x105, u32(4)); // active
  await until(async () => (await state()) === 5); // hold, before N10
  await send(0x1, Buffer.from([0]));
  await send(0x105, u32(4));
  await until(async () => (await read(interpolator, 0x21, 4, geo)).readInt32LE() >= 10);
  await send(0x105, u32(2)); // reset
  assert.equal(await state(), 2);
  await send(0x104, u32(2)); // automatic
  await send(0x108, name('stream.nc'));
  await send(0x105, u32(3));
  await send(0x105, u32(4));
  await send(0x90, Buffer.from('N500 V.G.SERVICE.REQUEST_STATE = 123\r\nM30\r\n\0', 'latin1'));
  await until(async () => (await state()) === 2);
  assert.equal((await ask(decoder, 0x48, 4, name('V.G.SERVICE.REQUEST_STATE'))).readUInt32LE(), 123);
});
