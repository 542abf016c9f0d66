// Read an MCAP with the official JavaScript reader, and print what is in it as JSON.
//
//     node read_mcap.mjs FOLDER FILE
//
// FOLDER is where npm has installed @mcap/core and @mcap/support.

import { createHash } from "node:crypto";
import { open } from "node:fs/promises";
import { createRequire } from "node:module";
import { join } from "node:path";

const [folder, path] = process.argv.slice(2);
const require = createRequire(join(folder, "package.json"));
const { McapIndexedReader, McapStreamReader } = require("@mcap/core");
const { loadDecompressHandlers } = require("@mcap/support");

const decompressHandlers = await loadDecompressHandlers();
const file = await open(path);
const size = (await file.stat()).size;

async function read(offset, length) {
  const buffer = new Uint8Array(Number(length));
  await file.read(buffer, 0, buffer.byteLength, Number(offset));
  return buffer;
}

function summarize(channel, schema) {
  return {
    schema: schema.name,
    encoding: channel.messageEncoding,
    times: [],
    sizes: [],
    hash: createHash("sha256"),
  };
}

const topics = {};
const readable = { size: async () => BigInt(size), read };
const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
for await (const message of reader.readMessages()) {
  const channel = reader.channelsById.get(message.channelId);
  const schema = reader.schemasById.get(channel.schemaId);
  const topic = (topics[channel.topic] ??= summarize(channel, schema));
  topic.times.push(`${message.logTime} ${message.publishTime}`);
  topic.sizes.push(message.data.byteLength);
  topic.hash.update(message.data);
}
for (const topic of Object.values(topics)) {
  topic.hash = topic.hash.digest("hex");
}

// Once more without the index, checking every checksum.
let streamed = 0;
const stream = new McapStreamReader({ decompressHandlers, validateCrcs: true });
stream.append(await read(0, size));
for (let record; (record = stream.nextRecord()); ) {
  streamed += record.type === "Message" ? 1 : 0;
}

const attachments = {};
for await (const attachment of reader.readAttachments()) {
  attachments[attachment.name] = Buffer.from(attachment.data).toString();
}
const metadata = {};
for await (const record of reader.readMetadata()) {
  metadata[record.name] = Object.fromEntries(record.metadata);
}
await file.close();

const counts = {};
for (const [id, count] of reader.statistics.channelMessageCounts) {
  counts[reader.channelsById.get(id).topic] = Number(count);
}
const { messageCount, messageStartTime, messageEndTime, chunkCount } = reader.statistics;
const statistics = {
  messages: Number(messageCount),
  chunks: Number(chunkCount),
  start: String(messageStartTime),
  end: String(messageEndTime),
  counts,
};
const chunks = reader.chunkIndexes.length;
console.log(JSON.stringify({ topics, streamed, chunks, statistics, attachments, metadata }));
