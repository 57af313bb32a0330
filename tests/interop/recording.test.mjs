// Recordings read by @mcap/core and protobufjs, which know nothing of millrace.
import assert from 'node:assert/strict';
import { execFileSync, spawnSync } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { crc32 } from '@foxglove/crc';
import unpackLz4 from '@foxglove/wasm-lz4';
import zstd from '@foxglove/wasm-zstd';
import { McapIndexedReader, McapStreamReader, McapWriter } from '@mcap/core';
import protobuf from 'protobufjs';
import 'protobufjs/ext/descriptor/index.js';

const bin = process.env.MILLRACE_BIN;
const calls = 1000;
const entriesPerCall = 7;
const start = BigInt(Date.UTC(2026, 2, 1, 7)) * 1_000_000n;
const milliseconds = (value) => BigInt(value) * 1_000_000n;

let folder;
let file;
let bytes;

before(async () => {
  await unpackLz4.isLoaded;
  await zstd.isLoaded;
  folder = mkdtempSync(join(tmpdir(), 'millrace-interop-'));
  file = join(folder, 'run.mcap');
  execFileSync(join(bin, '..', 'tests', 'write_recording'), [file, String(calls)]);
  bytes = readFileSync(file);
});

after(() => rmSync(folder, { recursive: true }));

const decompressHandlers = {
  lz4: (packed, size) => unpackLz4(packed, Number(size)),
  zstd: (packed, size) => zstd.decompress(packed, Number(size)),
};

const openIndexed = (buffer) =>
  McapIndexedReader.Initialize({
    decompressHandlers,
    readable: {
      size: async () => BigInt(buffer.length),
      read: async (offset, size) => buffer.subarray(Number(offset), Number(offset + size)),
    },
  });

/** All records a stream reader finds, and the error that stopped it. */
function stream(buffer) {
  const reader = new McapStreamReader({ validateCrcs: true, decompressHandlers });
  reader.append(buffer);
  const records = [];
  try {
    for (let record = reader.nextRecord(); record; record = reader.nextRecord()) {
      records.push(record);
    }
    return { records, done: reader.done() };
  } catch (error) {
    return { records, error };
  }
}

const messagesOf = ({ records }) => records.filter((record) => record.type === 'Message');

async function collect(messages) {
  const all = [];
  for await (const message of messages) {
    all.push(message);
  }
  return all;
}

test('the index, the statistics and the summary are right', async () => {
  const reader = await openIndexed(bytes);
  assert.equal(reader.statistics.messageCount, BigInt(calls * entriesPerCall));
  assert.equal(reader.statistics.chunkCount, reader.chunkIndexes.length);
  assert.equal(reader.statistics.attachmentCount, 1);
  assert.equal(reader.statistics.metadataCount, 1);
  assert.equal(reader.statistics.channelCount, reader.channelsById.size);
  assert.equal(reader.header.library, 'write_recording');
  const counted = [...reader.statistics.channelMessageCounts.values()].reduce((sum, count) => sum + count, 0n);
  assert.equal(counted, reader.statistics.messageCount);
});

test('every message decodes with the descriptor that the file carries', async () => {
  const reader = await openIndexed(bytes);
  const types = new Map();
  for (const schema of reader.schemasById.values()) {
    assert.equal(schema.encoding, 'protobuf');
    const root = protobuf.Root.fromDescriptor(protobuf.descriptor.FileDescriptorSet.decode(schema.data));
    types.set(schema.id, root.lookupType(schema.name));
  }
  let requests = 0;
  for await (const message of reader.readMessages()) {
    const channel = reader.channelsById.get(message.channelId);
    const decoded = types.get(channel.schemaId).decode(message.data);
    assert.equal(decoded.machine, 'cnc');
    if (channel.topic.endsWith('/request')) {
      ++requests;
      assert.equal(Buffer.from(decoded.text).toString('latin1'), `Ma\xdf ${decoded.call.number}`);
      assert.equal(channel.topic, `machine/cnc/${decoded.channel}/request`);
    }
  }
  assert.equal(requests, calls);
});

test('a window of time and topics is found by the index', async () => {
  const reader = await openIndexed(bytes);
  const window = {
    topics: ['machine/cnc/2/request'],
    startTime: start + milliseconds(5000),
    endTime: start + milliseconds(6000),
  };
  const found = await collect(reader.readMessages(window));
  assert.equal(found.length, 50);
  assert.ok(found.every((message, i) => i === 0 || message.logTime > found[i - 1].logTime));
});

test('metadata and attachment are found by their indexes', async () => {
  const reader = await openIndexed(bytes);
  const [metadata] = await collect(reader.readMetadata());
  assert.equal(metadata.name, 'millrace.recorder');
  assert.equal(metadata.metadata.get('host'), 'here');
  const [attachment] = await collect(reader.readAttachments());
  assert.equal(Buffer.from(attachment.data).toString(), 'machine {}');
});

test('the CRCs of chunks, data and summary are right', () => {
  const { records, done, error } = stream(bytes);
  assert.ifError(error);
  assert.ok(done);
  const dataEnd = records.find((record) => record.type === 'DataEnd');
  const footer = records.at(-1);
  const summaryStart = Number(footer.summaryStart);
  const dataEndSize = 9 + 4;
  assert.equal(dataEnd.dataSectionCrc, crc32(bytes.subarray(0, summaryStart - dataEndSize)));
  const magicAndCrc = 8 + 4;
  assert.equal(footer.summaryCrc, crc32(bytes.subarray(summaryStart, bytes.length - magicAndCrc)));
});

test('a flipped bit is noticed', async () => {
  const reader = await openIndexed(bytes);
  const damaged = Buffer.from(bytes);
  const chunk = reader.chunkIndexes[3];
  damaged[Number(chunk.chunkStartOffset + chunk.chunkLength) - 1] ^= 1;
  assert.match(stream(damaged).error.message, /Incorrect chunk CRC/);
});

test('a cut file gives both readers the same messages, and repair makes it open', async () => {
  const cut = bytes.subarray(0, Math.floor(bytes.length * 0.6));
  const theirs = messagesOf(stream(cut)).length;
  assert.ok(theirs > 0 && theirs < calls * entriesPerCall);
  const part = join(folder, 'cut.mcap.part');
  const whole = join(folder, 'cut.repaired.mcap');
  writeFileSync(part, cut);
  const repair = spawnSync(join(bin, 'millrace'), ['recording', 'repair', part], { encoding: 'utf8' });
  assert.equal(repair.status, 0, repair.stderr);
  const repaired = readFileSync(whole);
  const reader = await openIndexed(repaired);
  assert.equal(reader.statistics.messageCount, BigInt(theirs));
  assert.equal(messagesOf(stream(repaired)).length, theirs);
});

for (const compression of ['lz4', 'zstd']) {
  test(`what is compressed with ${compression} is read with its CRCs and by its index`, async () => {
    const packedFile = join(folder, `${compression}.mcap`);
    execFileSync(join(bin, '..', 'tests', 'write_recording'), [packedFile, String(calls), compression]);
    const packed = readFileSync(packedFile);
    assert.ok(packed.length < bytes.length / 2, `${packed.length} of ${bytes.length} bytes`);
    const { records, error } = stream(packed);
    assert.ifError(error);
    const theirs = messagesOf({ records });
    const plain = messagesOf(stream(bytes));
    assert.deepEqual(theirs.map((message) => message.data), plain.map((message) => message.data));
    const reader = await openIndexed(packed);
    assert.ok(reader.chunkIndexes.every((chunk) => chunk.compression === compression));
    const found = await collect(reader.readMessages({ topics: ['machine/cnc/2/request'] }));
    assert.equal(found.length, calls / 2);
  });
}

test('what others have compressed is read by recording cat and named by recording info', async () => {
  const source = await openIndexed(bytes);
  const parts = [];
  let position = 0n;
  const writer = new McapWriter({
    writable: {
      position: () => position,
      write: async (buffer) => {
        parts.push(Buffer.from(buffer));
        position += BigInt(buffer.length);
      },
    },
    chunkSize: 20_000,
    compressChunk: (chunk) => ({ compression: 'zstd', compressedData: zstd.compress(chunk) }),
  });
  await writer.start({ profile: '', library: 'somebody else' });
  const schemas = new Map();
  for (const schema of source.schemasById.values()) {
    schemas.set(schema.id, await writer.registerSchema(schema));
  }
  const channels = new Map();
  for (const channel of source.channelsById.values()) {
    channels.set(channel.id, await writer.registerChannel({ ...channel, schemaId: schemas.get(channel.schemaId) }));
  }
  for await (const message of source.readMessages()) {
    await writer.addMessage({ ...message, channelId: channels.get(message.channelId) });
  }
  await writer.end();
  const theirs = join(folder, 'theirs.mcap');
  writeFileSync(theirs, Buffer.concat(parts));

  const millrace = (...words) =>
    spawnSync(join(bin, 'millrace'), ['recording', ...words], { encoding: 'utf8', maxBuffer: 1 << 26 });
  const info = millrace('info', theirs);
  assert.equal(info.status, 0, info.stderr);
  assert.match(info.stdout, /compression zstd: \d+ chunks/);
  const lines = (path) => {
    const cat = millrace('cat', '--json', path);
    assert.equal(cat.status, 0, cat.stderr);
    return cat.stdout.trimEnd().split('\n').sort();
  };
  assert.deepEqual(lines(theirs), lines(file));
});

test('recording cat shows what the other reader decodes', async () => {
  const cat = spawnSync(join(bin, 'millrace'), ['recording', 'cat', '--kind', 'request', '--json', file], {
    encoding: 'utf8',
    maxBuffer: 1 << 26,
  });
  assert.equal(cat.status, 0, cat.stderr);
  const lines = cat.stdout.trimEnd().split('\n').map(JSON.parse);
  assert.equal(lines.length, calls);
  assert.equal(lines[4].text, 'Maß 5');
});
