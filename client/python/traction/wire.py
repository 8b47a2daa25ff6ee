"""Messages of proto/traction/v1 as Protobuf has them: the only module that sees Protobuf.

Made of the committed descriptors, in a pool of its own: no generated code, of whatever version of protoc, and nothing
that another one's could collide with. Packed floats and doubles are declared as what they are on the wire, bytes, so
that NumPy takes them as they lie there, and not Python number by number.
"""

from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.message import DecodeError

from .errors import Malformed

_Field = descriptor_pb2.FieldDescriptorProto


@cache
def _contract() -> Any:
    contract = resources.files(__package__).joinpath("v1.descriptors").read_bytes()
    return descriptor_pb2.FileDescriptorSet.FromString(contract).file


def _pool() -> Any:
    pool = descriptor_pool.DescriptorPool()
    for committed in _contract():
        file = descriptor_pb2.FileDescriptorProto()
        file.CopyFrom(committed)
        for message in file.message_type:
            for field in message.field:
                if field.label == _Field.LABEL_REPEATED and field.type in (_Field.TYPE_FLOAT, _Field.TYPE_DOUBLE):
                    field.type = _Field.TYPE_BYTES  # each of them a run of numbers; nearly always there is one
        pool.AddSerializedFile(file.SerializeToString())
    return pool


_POOL = _pool()


def _class(full_name: str) -> Any:
    found = _POOL.FindMessageTypeByName(full_name)
    if hasattr(message_factory, "GetMessageClass"):
        return message_factory.GetMessageClass(found)
    return message_factory.MessageFactory(_POOL).GetPrototype(found)  # before 4.22


@cache
def message(name: str) -> Any:
    """The class of a message, by its name in proto/traction/v1."""
    return _class("traction.v1." + name)


@dataclass(frozen=True)
class Member:
    """A field of a message, with the options that clients need (proto/traction/v1/options.proto)."""

    name: str
    type: str  # "double", or the name of a message or enum
    is_array: bool
    may_be_absent: bool
    metric: str  # name of the metric that it belongs to; empty: none


def members(name: str) -> list[Member]:
    """Returns the fields of a message in the order of their declaration."""
    options = _class("google.protobuf.FieldOptions")
    null, metric = (_POOL.FindExtensionByName("traction.v1." + each) for each in ("null_if_absent", "metric"))
    found = next(each for file in _contract() if file.package == "traction.v1"
                 for each in file.message_type if each.name == name)
    made = []
    for field in found.field:
        said = options.FromString(field.options.SerializeToString())
        kind = field.type_name.rpartition(".")[2] or _Field.Type.Name(field.type).removeprefix("TYPE_").lower()
        made.append(Member(field.name, kind, field.label == _Field.LABEL_REPEATED,
                           field.proto3_optional or said.Extensions[null], said.Extensions[metric].name))
    return made


def parse(name: str, payload: bytes) -> Any:
    """Raises Malformed."""
    made = message(name)()
    try:
        # Protobuf 3.21 in C++ ends at the end of a group that did not begin, and only warns.
        is_whole = made.MergeFromString(payload) == len(payload)
    except (DecodeError, RuntimeWarning):
        is_whole = False
    if not is_whole:
        raise Malformed("what arrived is no message of tractiond")
    return made
