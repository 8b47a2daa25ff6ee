// What the makers of MCAP read in recordings. usage: node read.js [--counts] FILE...
// For each file a line of JSON; with --counts only how many messages there are, by the index and from front to back.
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { readFileSync } from "node:fs";

/** The file's bytes, as the reader by the index wants them. */
function readable(bytes) {
  return {
    size: async () => BigInt(bytes.length),
    read: async (offset, length) => {
      if (offset + length > BigInt(bytes.length)) throw new Error("read behind the end");
      return new Uint8Array(bytes.subarray(Number(offset), Number(offset + length)));
    },
  };
}

/** Front to back: records of every kind, all CRCs checked. Of a whole recording only. */
function stream(bytes) {
  const reader = new McapStreamReader({ includeChunks: true, validateCrcs: true });
  reader.append(bytes);
  const chunks = [];
  let messages = 0;
  for (let record; (record = reader.nextRecord()); ) {
    if (record.type === "Chunk") chunks.push({ messages: 0 });
    if (record.type !== "Message") continue;
    ++messages;
    ++chunks[chunks.length - 1].messages;
  }
  if (!reader.done() || reader.bytesRemaining() !== 0) throw new Error("not read to its end");
  return { messages, chunks };
}

const base64 = (bytes) => Buffer.from(bytes).toString("base64");

const counts = process.argv[2] === "--counts";
for (const file of process.argv.slice(counts ? 3 : 2)) {
  const bytes = readFileSync(file);
  const indexed = await McapIndexedReader.Initialize({ readable: readable(bytes) });
  const fromFront = stream(bytes);
  const messages = [];
  for await (const message of indexed.readMessages({ validateCrcs: true })) {
    if (counts) {
      messages.push(0);
      continue;
    }
    messages.push({
      topic: indexed.channelsById.get(message.channelId).topic,
      sequence: message.sequence,
      log_time: String(message.logTime),
      publish_time: String(message.publishTime),
      data: base64(message.data),
    });
  }
  if (messages.length !== fromFront.messages) throw new Error("the index leads elsewhere");
  if (counts) {
    console.log(JSON.stringify({ messages: messages.length, statistics: Number(indexed.statistics.messageCount) }));
    continue;
  }
  const channels = [...indexed.channelsById.values()].map((channel) => {
    const schema = indexed.schemasById.get(channel.schemaId);
    return {
      topic: channel.topic,
      encoding: channel.messageEncoding,
      metadata: Object.fromEntries(channel.metadata),
      type: schema.name,
      schema_encoding: schema.encoding,
      schema: base64(schema.data),
      messages: Number(indexed.statistics.channelMessageCounts.get(channel.id)),
    };
  });
  const ends = indexed.chunkIndexes.map((chunk) => Number(chunk.chunkStartOffset + chunk.chunkLength));
  console.log(
    JSON.stringify({
      library: indexed.header.library,
      messages,
      channels,
      chunks: fromFront.chunks.map((chunk, i) => ({ end: ends[i], messages: chunk.messages })),
    }),
  );
}
