// Bytes of proto/traction/v1 -> plain objects with the members' own names. Made of the committed descriptors: no
// generated code. What Protobuf's wire is, @bufbuild/protobuf knows; it is seen here alone.
//
// Numbers of 64 bits are BigInt, ids hexadecimal text, enums words ("streaming"), flags lists of words, vectors arrays;
// repeated numbers of nodes and markers typed arrays, one after another as they travel; masks Uint8Array. What is not
// set has its default, or is null where that says something.
import descriptors from "#descriptors";
import {create, createFileRegistry, fromBinary, isFieldSet} from "@bufbuild/protobuf";
import {FieldDescriptorProto_Label as Label, FieldDescriptorProto_Type as Type, FileDescriptorSetSchema} from "@bufbuild/protobuf/wkt";

import {malformed} from "./errors.js";

const ids = new Set(["boot", "calibration", "zero", "id", "host", "run"]);
const nullable = new Set(["Description.zero", "Description.body", "Status.rest_drift", "Status.camera_link", "TrackedContact.slip"]);
/**
 * Machines are steered by these: a number among them that is NaN or infinite is refused. A detection limit of the solver
 * may be infinite.
 */
const finite = new Set(["Vector2", "Vector3", "Field", "Markers", "Covariance", "Contact", "TrackedContact", "Slip", "Interval", "CriticalPoint", "Finger",
  "Grasp", "PictureMotion", "Preview", "Gel", "NodeGrid", "MarkerLayer", "Camera", "RefractingSurface", "Zero", "Body"]);

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

const typed = {[Type.FLOAT]: Float32Array, [Type.DOUBLE]: Float64Array};
const arrays = new Map();  // "Field.force_N" -> Float32Array

/** The contract, in which packed floats and doubles are what they are on the wire, bytes: they are not taken number by number. */
function readContract() {
  const contract = fromBinary(FileDescriptorSetSchema, descriptors);
  for (const {messageType} of contract.file) {
    for (const message of messageType) {
      for (const member of message.field) {
        if (member.label !== Label.REPEATED || !typed[member.type]) continue;
        arrays.set(`${message.name}.${member.name}`, typed[member.type]);
        member.type = Type.BYTES;  // each of them a run of numbers; nearly always there is one
      }
    }
  }
  return createFileRegistry(contract);
}

const registry = readContract();

const wordsOf = new WeakMap();
/** "streaming" for CAMERA_STATE_STREAMING; the word of 0 for one of a later daemon. */
function wordOf(type, value) {
  if (!wordsOf.has(type)) {
    const prefix = type.values[0].name.slice(0, type.values[0].name.lastIndexOf("_") + 1);
    wordsOf.set(type, new Map(type.values.map(({name, number}) => [number, name.replace(prefix, "").toLowerCase()])));
  }
  return wordsOf.get(type).get(value) ?? wordsOf.get(type).get(0);
}

const flags = registry.getEnum("traction.v1.Flag");
const flagsIn = (bits) => flags.values.filter(({number}) => number & bits).map(({number}) => wordOf(flags, number));

const isFiniteAll = (numbers) => {
  // NaN and infinities stay so whatever is added; zero times any other number is zero.
  let sum = 0;
  for (let i = 0; i < numbers.length; ++i) sum += 0 * numbers[i];
  return sum === 0;
};

function finiteNumber(number) {
  require(Number.isFinite(number), "a number is not finite");
  return number;
}

/** Runs of numbers, one behind the other. Copied: they lie at any byte. */
function arrayOf(Numbers, runs, isFinite) {
  const bytes = new Uint8Array(runs.reduce((sum, run) => sum + run.length, 0));
  let at = 0;
  for (const run of runs) {
    bytes.set(run, at);
    at += run.length;
  }
  require(bytes.length % Numbers.BYTES_PER_ELEMENT === 0, "half a number");
  const numbers = new Numbers(bytes.buffer);
  require(!isFinite || isFiniteAll(numbers), "a number is not finite");
  return numbers;
}

const digits = Array.from({length: 256}, (_, byte) => byte.toString(16).padStart(2, "0"));
function hex(bytes) {
  require(bytes.length === 0 || bytes.length === 16, "an id has not 16 bytes");
  let text = "";
  for (let i = 0; i < bytes.length; ++i) text += digits[bytes[i]];
  return text;
}

/** What makes a member's value, in the form of this module, of that which Protobuf's library has. */
function converterOf(field) {
  const name = `${field.parent.name}.${field.name}`, Numbers = arrays.get(name), isFinite = finite.has(field.parent.name);
  if (Numbers) return (runs) => arrayOf(Numbers, runs, isFinite);
  if (field.listKind === "message") return (list) => list.map((each) => formOf(field.message, each));
  if (field.message) return (message) => formOf(field.message, message ?? create(field.message));
  if (field.enum) return (value) => wordOf(field.enum, value);
  if (field.scalar === Type.BYTES && ids.has(field.name)) return hex;
  return typed[field.scalar] && isFinite ? finiteNumber : (value) => value;
}

const members = new WeakMap();
function membersOf(type) {
  if (!members.has(type)) {
    members.set(type, type.fields.map((field) => ({
      field, name: field.name, convert: converterOf(field),
      isNullable: field.oneof || field.proto.proto3Optional || nullable.has(`${type.name}.${field.name}`),
    })));
  }
  return members.get(type);
}

/** A message in the form of this module. */
function formOf(type, message) {
  const out = {};
  for (const {field, name, convert, isNullable} of membersOf(type)) {
    const value = field.oneof ? message[field.oneof.localName].value : message[field.localName];
    out[name] = isNullable && !isFieldSet(message, field) ? null : convert(value);
  }
  if (type.name === "Vector2") return [out.x, out.y];
  if (type.name === "Vector3") return [out.x, out.y, out.z];
  if (type.name === "Header") out.flags = flagsIn(out.flags);
  checks[type.name]?.(out);
  return out;
}

/** @param name of a message in proto/traction/v1: "Field". @throws TractionError malformed */
export function decode(name, bytes) {
  const type = registry.getMessage(`traction.v1.${name}`);
  let message;
  try {
    message = fromBinary(type, bytes, {readUnknownFields: false});
  } catch {
    throw malformed("what arrived is no message of tractiond");
  }
  return formOf(type, message);
}

/** Which member of a reply is set: "zero"; null: none. */
export function answerIn(reply) {
  return ["status", "description", "zero"].find((name) => reply[name] !== null) ?? null;
}
