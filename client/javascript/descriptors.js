// The committed descriptors, in Node. (Bundlers take the file itself, as bytes.)
import {readFileSync} from "node:fs";

export default new Uint8Array(readFileSync(new URL("v1.descriptors", import.meta.url)));
