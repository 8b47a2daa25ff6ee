// Bytes of proto/traction/v1 -> plain objects with the members' own names. Made of the committed descriptors: no
// generated code. What Protobuf's wire is, @bufbuild/protobuf knows; it is seen here alone.
//
// Numbers of 64 bits are BigInt, ids hexadecimal text, enums words ("streaming"), flags lists of words, vectors arrays;
// repeated numbers of nodes and markers typed arrays, one after another as they travel; masks Uint8Array. What is not
// set has its default, or is null where that says something.
import descriptors from "#descriptors";
import {BinaryReader, WireType} from "@bufbuild/protobuf/wire";

import {malformed} from "./errors.js";

const Type = {double: 1, float: 2, int64: 3, uint64: 4, int32: 5, bool: 8, string: 9, message: 11, bytes: 12, uint32: 13,
  enum: 14};
const repeated = 3;

const utf8 = new TextDecoder("utf-8", {fatal: true, ignoreBOM: true});
const readUtf8 = (bytes) => utf8.decode(bytes);

const ids = new Set(["boot", "calibration", "zero", "id", "host", "run"]);
const nullable = new Set(["Description.zero", "Description.body", "Status.rest_drift", "Status.camera_link", "TrackedContact.slip"]);
const vectors = {Vector2: 2, Vector3: 3};
/**
 * Machines are steered by these: a number among them that is NaN or infinite is refused. A detection limit of the solver
 * may be infinite.
 */
const finite = new Set(["Field", "Markers", "Covariance", "Contact", "TrackedContact", "Slip", "Interval", "CriticalPoint", "Finger", "Grasp", "PictureMotion",
  "Preview", "Gel", "NodeGrid", "MarkerLayer", "Camera", "Zero", "Body"]);

function require(condition, what) {
  if (!condition) throw malformed(what);
}

const checks = {
  Camera(camera) {
    if (camera.aspect === 0) camera.aspect = 1;  // older daemons know square pixels alone
  },
  Field(field) {
    const nodes = field.node_valid.length;
    require(field.force_N.length === 3 * nodes, "the field's mask has another size");
    require([0, 3 * nodes].includes(field.node_deviation_N.length), "the field's deviations have another size");
  },
  Markers(markers) {
    const count = markers.marker_valid.length;
    require(markers.displacement_px.length === 2 * count && markers.variance_px2.length === count,
            "the markers' arrays have different sizes");
  },
  Zero(zero) {
    require(zero.rest_position_px.length === 2 * zero.marker_present.length, "the rest pose's mask has another size");
  },
  Body(body) {
    const nodes = body.node_areas_m2.length;
    require(body.node_positions_m.length === 3 * nodes && body.node_normals.length === 3 * nodes &&
            body.marker_positions_m.length % 3 === 0, "the body's nodes have other sizes");
  },
  Covariance(covariance) {
    for (const name of ["noise", "systematic"]) {
      if (covariance[name].length === 0) covariance[name] = new Float64Array(9);
      require(covariance[name].length === 9, "a covariance has not 9 numbers");
    }
  },
  Preview({width, height, format, pixels}) {
    const bytes = {mono8: 1, rgb8: 3}[format];
    require(bytes !== undefined, "the preview's format is unknown");
    require(pixels.length === width * height * bytes, "the preview has more or fewer pixels than its size says");
  },
  Histogram(all) {
    require(all.count.length === 0 || all.count.length === all.bound_s.length + 1, "a histogram has no count for each bound");
  },
};

// The contract. Its own form is described to the reader in a few words.
const one = (name, type, message) => ({name, type, message, repeated: false});
const many = (name, type, message) => ({name, type, message, repeated: true});
const contract = {
  FileSet: {1: many("file", Type.message, "File")},
  File: {4: many("messages", Type.message, "Message"), 5: many("enums", Type.message, "Enum")},
  Message: {1: one("name", Type.string), 2: many("fields", Type.message, "Member")},
  Member: {1: one("name", Type.string), 3: one("number", Type.int32), 4: one("label", Type.int32), 5: one("type", Type.int32),
    6: one("of", Type.string), 17: one("optional", Type.bool)},
  Enum: {1: one("name", Type.string), 2: many("values", Type.message, "Word")},
  Word: {1: one("name", Type.string), 2: one("number", Type.int32)},
};

function readContract() {
  const types = {}, words = {}, flags = [];
  const lastOf = (name) => name.slice(name.lastIndexOf(".") + 1);
  for (const file of decodeWith(contract, "FileSet", descriptors).file) {
    for (const {name, fields} of file.messages ?? []) {
      types[name] = {};
      for (const member of fields ?? []) {
        types[name][member.number] = {
          name: member.name, type: member.type, repeated: member.label === repeated, optional: member.optional,
          message: member.type === Type.message ? lastOf(member.of) : undefined,
          enum: member.type === Type.enum ? lastOf(member.of) : undefined,
          isId: member.type === Type.bytes && ids.has(member.name),
          isNullable: member.optional || nullable.has(`${name}.${member.name}`),
          isFinite: finite.has(name),
        };
      }
    }
    for (const {name, values} of file.enums ?? []) {
      const prefix = values[0].name.slice(0, values[0].name.lastIndexOf("_") + 1);
      const word = (value) => value.name.replace(prefix, "").toLowerCase();
      words[name] = new Map(values.map((value) => [value.number, word(value)]));
      if (name === "Flag") flags.push(...values.filter((value) => value.number).map((value) => [value.number, word(value)]));
    }
  }
  return {types, words, flags};
}

/** Of a member that did not come. */
function unset(types, member) {
  if (member.repeated) {
    return member.type === Type.float ? new Float32Array() : member.type === Type.double ? new Float64Array() : [];
  }
  if (member.isNullable) return null;
  switch (member.type) {
    case Type.message: return complete(types, member.message, {});
    case Type.string: return "";
    case Type.bool: return false;
    case Type.bytes: return member.isId ? "" : new Uint8Array();
    case Type.enum: return words[member.enum].get(0);
    case Type.int64: case Type.uint64: return 0n;
    default: return 0;
  }
}

/** A run of floats or doubles, behind those that came before. Copied: it lies at any byte. */
function append(before, bytes, Numbers) {
  require(bytes.length % Numbers.BYTES_PER_ELEMENT === 0, "half a number");
  const run = new Numbers(bytes.slice().buffer);
  if (!before?.length) return run;
  const whole = new Numbers(before.length + run.length);
  whole.set(before);
  whole.set(run, before.length);
  return whole;
}

const wireOf = {[Type.double]: WireType.Bit64, [Type.float]: WireType.Bit32, [Type.string]: WireType.LengthDelimited,
  [Type.bytes]: WireType.LengthDelimited, [Type.message]: WireType.LengthDelimited};

function scalar(reader, type) {
  switch (type) {
    case Type.double: return reader.double();
    case Type.float: return reader.float();
    case Type.int64: return BigInt(reader.int64());
    case Type.uint64: return BigInt(reader.uint64());
    case Type.bool: return reader.bool();
    case Type.uint32: return reader.uint32();
    case Type.string: return reader.string();
    case Type.bytes: return reader.bytes();
    default: return reader.int32();
  }
}

/** Members that came, merged into `object` as Protobuf wants it. */
function take(types, name, reader, end, object) {
  while (reader.pos < end) {
    const [number, wire] = reader.tag();
    const member = types[name][number];
    const own = wireOf[member?.type] ?? WireType.Varint;
    const isPacked = member?.repeated && wire === WireType.LengthDelimited && own !== WireType.LengthDelimited;
    if (!member || (wire !== own && !isPacked)) {
      reader.skip(wire, number);
      continue;
    }
    const before = object[member.name];
    if (member.type === Type.message) {
      const until = reader.uint32() + reader.pos;
      require(until <= end, "a message is cut short");
      const part = take(types, member.message, reader, until, (!member.repeated && before) || {});
      if (member.repeated) (object[member.name] ??= []).push(part);
      else object[member.name] = part;
    } else if (isPacked) {
      const bytes = reader.bytes();
      if (member.type === Type.float || member.type === Type.double) {
        object[member.name] = append(before, bytes, member.type === Type.float ? Float32Array : Float64Array);
      } else {
        const run = new BinaryReader(bytes);
        const list = (object[member.name] ??= []);
        while (run.pos < run.len) list.push(scalar(run, member.type));
      }
    } else if (member.repeated) {
      const value = scalar(reader, member.type);
      if (member.type === Type.float) object[member.name] = Float32Array.of(...(before ?? []), value);
      else if (member.type === Type.double) object[member.name] = Float64Array.of(...(before ?? []), value);
      else (object[member.name] ??= []).push(value);
    } else {
      object[member.name] = scalar(reader, member.type);
    }
  }
  require(reader.pos === end, "a message is cut short");
  return object;
}

const digits = Array.from({length: 256}, (_, byte) => byte.toString(16).padStart(2, "0"));
function hex(bytes) {
  require(bytes.length === 0 || bytes.length === 16, "an id has not 16 bytes");
  let text = "";
  for (let i = 0; i < bytes.length; ++i) text += digits[bytes[i]];
  return text;
}

const isFiniteAll = (numbers) => {
  // NaN and infinities stay so whatever is added; zero times any other number is zero.
  let sum = 0;
  for (let i = 0; i < numbers.length; ++i) sum += 0 * numbers[i];
  return sum === 0;
};

const lists = new WeakMap();
/** Object.values() of the same type, message after message. */
function membersOf(type) {
  if (!lists.has(type)) lists.set(type, Object.values(type));
  return lists.get(type);
}

/** The rest of the members, in the form of this module. */
function complete(types, name, object) {
  if (vectors[name] === 3) return [object.x ?? 0, object.y ?? 0, object.z ?? 0];
  if (vectors[name] === 2) return [object.x ?? 0, object.y ?? 0];
  const out = {};
  for (const member of membersOf(types[name])) {
    let value = object[member.name];
    if (value === undefined) value = unset(types, member);
    else if (member.message && member.repeated) value = value.map((each) => complete(types, member.message, each));
    else if (member.message) value = complete(types, member.message, value);
    else if (member.isId) value = hex(value);
    else if (member.enum) value = words[member.enum].get(value) ?? words[member.enum].get(0);
    if (member.isFinite) {
      const isVector = vectors[member.message] !== undefined;
      if (isVector || ArrayBuffer.isView(value)) require(isFiniteAll(value), "a number is not finite");
      else if (member.type === Type.double) require(Number.isFinite(value), "a number is not finite");
    }
    out[member.name] = value;
  }
  if (name === "Header") out.flags = flags.filter(([bit]) => out.flags & bit).map(([, word]) => word);
  checks[name]?.(out);
  return out;
}

function decodeWith(types, name, bytes) {
  let object;
  try {
    object = take(types, name, new BinaryReader(bytes, readUtf8), bytes.length, {});
  } catch (error) {
    if (error.code === "malformed") throw error;
    throw malformed("what arrived is no message of tractiond");
  }
  return types === contract ? object : complete(types, name, object);
}

const {types, words, flags} = readContract();

/** @param name of a message in proto/traction/v1: "Field". @throws TractionError malformed */
export function decode(name, bytes) {
  return decodeWith(types, name, bytes);
}

/** Which member of a reply is set: "zero"; null: none. */
export function answerIn(reply) {
  return ["status", "description", "zero"].find((name) => reply[name] !== null) ?? null;
}

for (const member of Object.values(types.Reply)) member.isNullable = member.message !== undefined;
