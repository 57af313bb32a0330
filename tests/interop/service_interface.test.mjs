// An independent ADS client (npm ads-client) reads and writes the five variables of the Service Interface
// through every generic function of the decoder.
import assert from 'node:assert/strict';
import { after, before, test } from 'node:test';
import { Client } from 'ads-client';
import { adsClientSettings, startVirtualCnc } from './virtual_cnc.mjs';

const sda = 552;
const decoder = (channel) => 0x122300 + channel;
const handleByName = 0x46;
const readByHandle = 0x47;
const readByName = 0x48;
const writeByHandle = 0x49;
const writeByName = 0x4a;
const describeByName = 0x4c;
const strings = ['V.G.SERVICE.UUID', 'V.G.SERVICE.REQUEST', 'V.G.SERVICE.RESPONSE'];
const numbers = ['V.G.SERVICE.REQUEST_STATE', 'V.G.SERVICE.RESPONSE_STATE'];

const name = (text) => Buffer.from(`${text}\0`, 'latin1');
const u32 = (...values) => {
  const bytes = Buffer.alloc(4 * values.length);
  values.forEach((value, i) => bytes.writeUInt32LE(value, 4 * i));
  return bytes;
};
const text = (bytes) => bytes.toString('latin1').split('\0')[0];

let cnc;
let client;

before(async () => {
  cnc = await startVirtualCnc('--channels', '2');
  client = new Client(adsClientSettings(cnc.port, sda));
  await client.connect();
});

after(async () => {
  await client?.disconnect();
  await cnc?.stop();
});

const write = (channel, variable, value) =>
  client.writeRaw(decoder(channel), writeByName, Buffer.concat([name(variable), value]));
const read = (channel, variable) =>
  client.readWriteRaw(decoder(channel), readByName, 256, name(variable));

test('the controller tells its state and its name', async () => {
  const state = await client.readState();
  assert.equal(state.adsState, 5); // run
  const info = await client.readDeviceInfo();
  assert.ok(info.deviceName.length > 0);
});

for (const variable of strings) {
  test(`${variable} is written and read by name, 127 characters of CP1252 and the NUL`, async () => {
    const longest = 'ä'.repeat(127);
    await write(1, variable, Buffer.from(`${longest}\0`, 'latin1'));
    assert.equal(text(await read(1, variable)), longest);
  });
}

for (const variable of numbers) {
  test(`${variable} is written and read by name as 32 bits`, async () => {
    await write(1, variable, u32(0xfffffffe));
    const value = await read(1, variable);
    assert.equal(value.length, 4);
    assert.equal(value.readUInt32LE(), 0xfffffffe);
  });
}

test('every variable is written and read by handle', async () => {
  for (const variable of [...strings, ...numbers]) {
    const value = strings.includes(variable) ? name('by handle') : u32(7);
    const handle = (await client.readWriteRaw(decoder(1), handleByName, 4, name(variable))).readUInt32LE();
    await client.writeRaw(decoder(1), writeByHandle, Buffer.concat([u32(handle, 0), value]));
    const back = await client.readWriteRaw(decoder(1), readByHandle, 256, u32(handle, 0));
    assert.deepEqual(back.subarray(0, value.length), value, variable);
  }
});

test('the description tells type, access and size', async () => {
  const describe = async (variable) => {
    const bytes = await client.readWriteRaw(decoder(1), describeByName, 256, name(variable));
    return { type: bytes.readUInt32LE(4), access: bytes.readUInt32LE(8), size: bytes.readUInt32LE(12) };
  };
  const readWrite = 2;
  assert.deepEqual(await describe('V.G.SERVICE.REQUEST'), { type: 9, access: readWrite, size: 128 });
  assert.deepEqual(await describe('V.G.SERVICE.REQUEST_STATE'), { type: 7, access: readWrite, size: 4 });
});

test('channels keep their variables apart', async () => {
  await write(1, 'V.G.SERVICE.REQUEST', name('one'));
  await write(2, 'V.G.SERVICE.REQUEST', name('two'));
  assert.equal(text(await read(1, 'V.G.SERVICE.REQUEST')), 'one');
  assert.equal(text(await read(2, 'V.G.SERVICE.REQUEST')), 'two');
});

const refused = async (code, call) => {
  await assert.rejects(call, (error) => {
    assert.equal(Number(error.adsError?.errorCode), code, JSON.stringify(error));
    return true;
  });
};

test('a channel that does not exist is an invalid index group', () =>
  refused(0x702, client.readWriteRaw(decoder(3), readByName, 4, name('V.G.SERVICE.REQUEST_STATE'))));

test('a function that does not exist is an invalid index offset', () =>
  refused(0x703, client.readWriteRaw(decoder(1), 0x4d, 4, name('V.G.SERVICE.REQUEST_STATE'))));

test('an unknown variable is a symbol that was not found', () => refused(0x710, read(1, 'V.G.SERVICE.REQEST')));

test('a value of the wrong size is refused and changes nothing', async () => {
  await write(1, 'V.G.SERVICE.REQUEST_STATE', u32(5));
  await refused(0x705, write(1, 'V.G.SERVICE.REQUEST_STATE', Buffer.alloc(2)));
  assert.equal((await read(1, 'V.G.SERVICE.REQUEST_STATE')).readUInt32LE(), 5);
  await refused(0x705, write(1, 'V.G.SERVICE.REQUEST', Buffer.alloc(129, 'x')));
});
