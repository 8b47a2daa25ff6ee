// What readers that are not ours find in a recording of ROS 2's messages. usage: node read_ros2.js FILE
// Prints a line of JSON. Of each channel `is_ros`: its definitions are those of ROS 2; of each message `is_same_bytes`: a writer
// that is not ours makes the same bytes of it. Arrays of bytes are hexadecimal.
import { CdrReader, EncapsulationKind } from "@foxglove/cdr";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { parse } from "@foxglove/rosmsg";
import common from "@foxglove/rosmsg-msgs-common";
import { MessageReader, MessageWriter } from "@foxglove/rosmsg2-serialization";
import { readFileSync } from "node:fs";
import { isDeepStrictEqual } from "node:util";

const bytes = readFileSync(process.argv[2]);
const readable = {
  size: async () => BigInt(bytes.length),
  read: async (offset, length) => {
    if (offset + length > BigInt(bytes.length)) throw new Error("read behind the end");
    return new Uint8Array(bytes.subarray(Number(offset), Number(offset + length)));
  },
};

/** Without the members that are undefined. */
const plain = (value) => JSON.parse(JSON.stringify(value));

/** Those of a release, without constants that only later ones have. */
const commonOf = (members, release) =>
  release.filter(({ name, isConstant }) => !isConstant || members.some((member) => member.name === name));

/** Tells whether each definition is the one of the releases Humble and Jazzy. The first, without a name, is that of `kind`. */
const isRos = (definitions, kind) =>
  definitions.every(({ name = kind, definitions: members }) =>
    [common.ros2humble, common.ros2jazzy].every((release) => isDeepStrictEqual(plain(members), plain(commonOf(members, release[name].definitions)))),
  );

/** Throws unless the group is of whole records of its kind. */
function checkGroup({ groupOpcode, groupStart, groupLength }) {
  const end = Number(groupStart + groupLength);
  let at = Number(groupStart);
  for (; at < end; at += 9 + Number(bytes.readBigUInt64LE(at + 1))) {
    if (bytes[at] !== groupOpcode) throw new Error("a summary offset leads elsewhere");
  }
  if (at !== end) throw new Error("a group of the summary has another length");
}

// Front to back, all checksums verified.
const stream = new McapStreamReader({ includeChunks: true, validateCrcs: true });
stream.append(bytes);
let chunks = 0;
let streamed = 0;
for (let record; (record = stream.nextRecord()); ) {
  if (record.type === "Chunk") ++chunks;
  if (record.type === "Message") ++streamed;
  if (record.type === "SummaryOffset") checkGroup(record);
}
if (!stream.done() || stream.bytesRemaining() !== 0) throw new Error("not read to its end");

const indexed = await McapIndexedReader.Initialize({ readable });
const coders = new Map();
const channels = [...indexed.channelsById.values()].map((channel) => {
  const schema = indexed.schemasById.get(channel.schemaId);
  const definitions = parse(new TextDecoder().decode(schema.data), { ros2: true });
  coders.set(channel.id, { reader: new MessageReader(definitions), writer: new MessageWriter(definitions) });
  return {
    topic: channel.topic,
    encoding: channel.messageEncoding,
    metadata: Object.fromEntries(channel.metadata),
    type: schema.name,
    schema_encoding: schema.encoding,
    is_ros: isRos(definitions, schema.name.replace("/msg/", "/")),
    messages: Number(indexed.statistics.channelMessageCounts.get(channel.id)),
  };
});
const messages = [];
for await (const { channelId, data, sequence, logTime, publishTime } of indexed.readMessages({ validateCrcs: true })) {
  const { reader, writer } = coders.get(channelId);
  const message = reader.readMessage(data);
  messages.push({
    topic: indexed.channelsById.get(channelId).topic,
    sequence,
    log_time: String(logTime),
    publish_time: String(publishTime),
    encapsulation: EncapsulationKind[new CdrReader(data).kind],
    message,
    is_same_bytes: Buffer.compare(writer.writeMessage(message), data) === 0,
  });
}
if (messages.length !== streamed) throw new Error("the index leads elsewhere");
if (messages.length !== Number(indexed.statistics.messageCount)) throw new Error("the statistics count others");
const metadata = [];
for await (const { name, metadata: table } of indexed.readMetadata()) {
  metadata.push({ name, metadata: Object.fromEntries(table) });
}
const { profile, library } = indexed.header;
console.log(
  JSON.stringify({ profile, library, chunks, metadata, channels, messages }, (_, value) =>
    value instanceof Uint8Array ? Buffer.from(value).toString("hex") : value,
  ),
);
