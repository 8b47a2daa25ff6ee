"""Messages of proto/traction/v1 as Protobuf has them: the only module that sees Protobuf.

Made of the committed descriptors, in a pool of its own: no generated code, of whatever version of protoc, and nothing
that another one's could collide with. Packed floats and doubles are declared as what they are on the wire, bytes, so
that NumPy takes them as they lie there, and not Python number by number.
"""

from functools import cache
from importlib import resources
from typing import Any

from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from google.protobuf.message import DecodeError

from .errors import Malformed

_Field = descriptor_pb2.FieldDescriptorProto


def _pool() -> Any:
    contract = resources.files(__package__).joinpath("v1.descriptors").read_bytes()
    pool = descriptor_pool.DescriptorPool()
    for file in descriptor_pb2.FileDescriptorSet.FromString(contract).file:
        for message in file.message_type:
            for field in message.field:
                if field.label == _Field.LABEL_REPEATED and field.type in (_Field.TYPE_FLOAT, _Field.TYPE_DOUBLE):
                    field.type = _Field.TYPE_BYTES  # each of them a run of numbers; nearly always there is one
        pool.AddSerializedFile(file.SerializeToString())
    return pool


_POOL = _pool()


@cache
def message(name: str) -> Any:
    """The class of a message, by its name in proto/traction/v1."""
    found = _POOL.FindMessageTypeByName("traction.v1." + name)
    if hasattr(message_factory, "GetMessageClass"):
        return message_factory.GetMessageClass(found)
    return message_factory.MessageFactory(_POOL).GetPrototype(found)  # before 4.22


def parse(name: str, payload: bytes) -> Any:
    """Raises Malformed."""
    try:
        return message(name).FromString(payload)
    except DecodeError:
        raise Malformed("what arrived is no message of tractiond") from None
