"""The Python client under the conformance suite: docs/clients.md says what a reader is."""

import base64
import dataclasses
import enum
import json
import sys

import numpy as np

import traction
from form import echo


def plain(value):
    """A message of the client as JSON has it."""
    if dataclasses.is_dataclass(value):
        return {one.name: plain(getattr(value, one.name)) for one in dataclasses.fields(value)}
    if isinstance(value, traction.Flag):
        return [flag.name.lower() for flag in traction.Flag if flag in value]
    if isinstance(value, enum.Enum):
        return value.name.lower()
    if isinstance(value, np.ndarray) and value.dtype == np.uint8:
        return base64.b64encode(value.tobytes()).decode()
    if isinstance(value, np.ndarray):
        is_matrix = value.shape == (3, 3) and value.dtype == np.float64
        return (value.ravel() if is_matrix else value).tolist()
    if isinstance(value, tuple):
        return [plain(one) for one in value]
    return value.hex() if isinstance(value, bytes) else value


def tell(kind, read):
    """`read` and say what came of it."""
    try:
        message = read()
    except traction.Error as error:
        return {"error": error.code}
    return {"message": echo(kind or type(message).__name__.lower(), plain(message))}


def main():
    mode, endpoint = sys.argv[1:]
    if mode == "control":
        control = traction.Control(endpoint=endpoint)
        asks = {"status": control.status, "describe": control.describe, "zero": control.zero, "undo": control.undo_zero}
        for line in sys.stdin:
            what = line.strip()
            kind = {"describe": "description", "undo": "zero"}.get(what, what)
            print(json.dumps(tell(kind, asks[what])), flush=True)
        return
    with traction.Subscriber(endpoint=endpoint, mode=traction.Mode(mode),
                             topics=traction.Topics.ALL | traction.Topics.PREVIEW | traction.Topics.OF_TOUCH) as subscriber:
        while True:
            told = tell(None, subscriber.receive)
            print(json.dumps({**told, "lost": subscriber.lost}), flush=True)


main()
