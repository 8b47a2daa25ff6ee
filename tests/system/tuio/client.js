// TUIO 1.1 and 2.0 as programs read them. usage: node client.js
// Prints {"port": PORT}, then a line for each touch that is added, changed or removed, of either version.
import osc from "osc";
import { Tuio11Client, Tuio20Client, TuioReceiver } from "./node_modules/tuio-client/dist/tuio-client.es.js";

/** Passes on what another library decodes. */
class Receiver extends TuioReceiver {
  connect() {}
  disconnect() {}
}

const tell = (values) => process.stdout.write(JSON.stringify(values) + "\n");
const receiver = new Receiver();
const first = new Tuio11Client(receiver);
const second = new Tuio20Client(receiver);
first.connect();
second.connect();

const of11 = (event) => (cursor) =>
  tell({ version: 1, event, id: cursor.sessionId, x: cursor.position.x, y: cursor.position.y, vx: cursor.velocity.x });
const none = () => {};
first.addTuioListener({
  addTuioCursor: of11("add"), updateTuioCursor: of11("update"), removeTuioCursor: of11("remove"),
  addTuioObject: none, updateTuioObject: none, removeTuioObject: none,
  addTuioBlob: none, updateTuioBlob: none, removeTuioBlob: none, refresh: none,
});
const of20 = (event) => (object) => {
  const { position, velocity, shear, radius, press } = object.pointer;
  tell({ version: 2, event, id: object.sessionId, x: position.x, y: position.y, vy: velocity.y, shear, radius, press });
};
second.addTuioListener({ tuioAdd: of20("add"), tuioUpdate: of20("update"), tuioRemove: of20("remove"), tuioRefresh: none });

const port = new osc.UDPPort({ localAddress: "127.0.0.1", localPort: 0 });
port.on("ready", () => tell({ port: port.socket.address().port }));
port.on("error", (error) => tell({ event: "error", message: error.message }));
/** A time as the number that the other library takes. */
const number = (argument) => (argument?.raw ? (BigInt(argument.raw[0]) << 32n) | BigInt(argument.raw[1]) : argument);
port.on("message", ({ address, args }) => receiver.onOscMessage({ address, args: args.map(number) }));
port.open();
