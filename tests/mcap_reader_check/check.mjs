// Reads recordings with the official reader through the index and from front to back, with all checksums verified, decodes every
// message by the schema in the file, and prints what it saw as JSON: per file the counts of each topic, their first message, the
// statistics and the order of time.
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { open, readFile } from "node:fs/promises";
import protobuf from "protobufjs";
import "protobufjs/ext/descriptor/index.js";

class FileReadable {
  constructor(handle, size) {
    this.handle = handle;
    this.bytes = BigInt(size);
  }
  async size() {
    return this.bytes;
  }
  async read(offset, length) {
    const buffer = new Uint8Array(Number(length));
    const { bytesRead } = await this.handle.read(buffer, 0, Number(length), Number(offset));
    if (bytesRead !== Number(length)) throw new Error(`short read at ${offset}`);
    return buffer;
  }
}

function plain(key, value) {
  if (typeof value === "bigint") return value.toString();
  return typeof value === "number" && !Number.isFinite(value) ? String(value) : value;
}

async function check(file) {
  const handle = await open(file);
  const reader = await McapIndexedReader.Initialize({
    readable: new FileReadable(handle, (await handle.stat()).size),
  });
  const decoders = new Map();
  for (const [id, channel] of reader.channelsById) {
    const schema = reader.schemasById.get(channel.schemaId);
    decoders.set(id, protobuf.Root.fromDescriptor(schema.data).lookupType(schema.name));
  }
  const topics = {};
  let last = 0n;
  let ordered = true;
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    const channel = reader.channelsById.get(message.channelId);
    const decoder = decoders.get(message.channelId);
    const decoded = decoder.toObject(decoder.decode(message.data), { longs: String, defaults: false });
    const topic = (topics[channel.topic] ??= { count: 0, first: decoded });
    topic.count += 1;
    topic.last = decoded;
    ordered &&= message.logTime >= last;
    last = message.logTime;
  }

  // From front to back the reader also compares the checksum of the data and of the index.
  const stream = new McapStreamReader({ validateCrcs: true });
  stream.append(await readFile(file));
  let streamed = 0;
  for (let record; (record = stream.nextRecord()); ) streamed += record.type === "Message" ? 1 : 0;
  if (!stream.done()) throw new Error("the stream reader sees no end");
  await handle.close();
  const { messageCount, channelCount, schemaCount, chunkCount, messageStartTime, messageEndTime } = reader.statistics;
  return {
    topics,
    ordered,
    streamed,
    statistics: { messageCount, channelCount, schemaCount, chunkCount, messageStartTime, messageEndTime },
  };
}

const result = {};
for (const file of process.argv.slice(2)) result[file.split("/").pop()] = await check(file);
console.log(JSON.stringify(result, plain, 1));
