// Foxglove's own client, driven by lines of JSON. usage: node client.js URL [SUBPROTOCOL...]
// Reads {"subscribe": TOPIC}, {"unsubscribe": TOPIC}, {"send": TEXT}, {"sendBinary": BASE64} from the standard input; writes a line
// for each event. Messages are decoded by nothing but the schema that the server advertises.
import protocol from "@foxglove/ws-protocol";
import protobuf from "protobufjs";
import "protobufjs/ext/descriptor/index.js";
import { createInterface } from "node:readline";
import WebSocket from "ws";

const { FoxgloveClient } = protocol;
const [url, ...subprotocols] = process.argv.slice(2);
const socket = new WebSocket(url, subprotocols.length > 0 ? subprotocols : [FoxgloveClient.SUPPORTED_SUBPROTOCOL]);
const client = new FoxgloveClient({ ws: socket });
const channels = new Map(); // by topic
const subscriptions = new Map(); // topic -> subscription id
const topics = new Map(); // subscription id -> topic; kept after unsubscribing

const tell = (event, values) => process.stdout.write(JSON.stringify({ event, ...values }) + "\n");

/** The message type of a channel, from its FileDescriptorSet. */
function typeOf(channel) {
  const { FileDescriptorSet } = protobuf.descriptor;
  const root = protobuf.Root.fromDescriptor(FileDescriptorSet.decode(Buffer.from(channel.schema, "base64")));
  return root.lookupType(channel.schemaName);
}

client.on("open", () => tell("open", { subprotocol: socket.protocol }));
client.on("error", (error) => tell("error", { message: error.message }));
client.on("close", () => {
  tell("close", {});
  process.exit(0);
});
client.on("serverInfo", (info) => tell("serverInfo", { info }));
client.on("status", (status) => tell("status", { status }));
client.on("advertise", (added) => {
  for (const channel of added) channels.set(channel.topic, { channel, type: typeOf(channel) });
  tell("advertise", { channels: added.map(({ schema, ...rest }) => ({ ...rest, schemaSize: schema.length })) });
});
client.on("message", ({ subscriptionId, timestamp, data }) => {
  const topic = topics.get(subscriptionId);
  if (topic === undefined) return tell("error", { message: `unknown subscription ${subscriptionId}` });
  const { type } = channels.get(topic);
  const message = type.decode(new Uint8Array(data.buffer, data.byteOffset, data.byteLength));
  const object = type.toObject(message, { longs: String, bytes: String, defaults: true, arrays: true });
  tell("message", { topic, time_ns: String(timestamp), bytes: data.byteLength, message: object });
});

createInterface({ input: process.stdin })
  .on("line", (line) => {
    const task = JSON.parse(line);
    if (task.subscribe !== undefined) {
      const id = client.subscribe(channels.get(task.subscribe).channel.id);
      subscriptions.set(task.subscribe, id);
      topics.set(id, task.subscribe);
    }
    if (task.unsubscribe !== undefined) client.unsubscribe(subscriptions.get(task.unsubscribe));
    if (task.send !== undefined) socket.send(task.send);
    if (task.sendBinary !== undefined) socket.send(Buffer.from(task.sendBinary, "base64"));
  })
  .on("close", () => process.exit(0));
