// What the makers of MCAP read in recordings. usage: node read.js FILE...
// For each file a line of JSON.
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

/** Returns the number of messages, front to back: records of every kind, all CRCs checked. Of a whole recording only. */
function count(bytes) {
  const reader = new McapStreamReader({ includeChunks: true, validateCrcs: true });
  reader.append(bytes);
  let messages = 0;
  for (let record; (record = reader.nextRecord()); ) messages += record.type === "Message" ? 1 : 0;
  if (!reader.done() || reader.bytesRemaining() !== 0) throw new Error("not read to its end");
  return messages;
}

const base64 = (bytes) => Buffer.from(bytes).toString("base64");

for (const file of process.argv.slice(2)) {
  const bytes = readFileSync(file);
  const indexed = await McapIndexedReader.Initialize({ readable: readable(bytes) });
  const fromFront = count(bytes);
  const messages = [];
  for await (const message of indexed.readMessages({ validateCrcs: true })) {
    messages.push({
      topic: indexed.channelsById.get(message.channelId).topic,
      sequence: message.sequence,
      log_time: String(message.logTime),
      publish_time: String(message.publishTime),
      data: base64(message.data),
    });
  }
  if (messages.length !== fromFront) throw new Error("the index leads elsewhere");
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
  console.log(
    JSON.stringify({
      library: indexed.header.library,
      messages,
      channels,
    }),
  );
}
