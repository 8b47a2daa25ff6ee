"""Keys, for a tractiond that is reached through a traction-gateway: docs/gateway.md."""

import os
import stat
import struct
import tomllib
from dataclasses import dataclass
from typing import Any

import zmq
from zmq.utils import z85

from .errors import BadKeys


@dataclass(frozen=True)
class Keys:
    """CURVE's, as 40 letters of Z85."""

    server_key: str  # of the gateway's box, public
    public_key: str
    secret_key: str  # of this side


def _is_key(text: object) -> bool:
    try:
        return isinstance(text, str) and len(text) == 40 and len(z85.decode(text.encode())) == 32  # type: ignore[no-untyped-call]
    except (KeyError, ValueError, struct.error):
        return False


def load_keys(path: str | os.PathLike[str], server_key: str = "") -> Keys:
    """From a file of `tractionctl keys new`; the server's key where the file has it and none is given. Raises BadKeys."""
    try:
        with open(path, "rb") as file:
            mode, owner = os.fstat(file.fileno()).st_mode, os.fstat(file.fileno()).st_uid
            table: dict[str, Any] = tomllib.loads(file.read().decode("utf-8-sig"))
    except (OSError, ValueError) as error:
        raise BadKeys(f"{path}: {error}") from None
    if stat.S_IMODE(mode) & (0o037 if owner == 0 else 0o077):  # root's file may be read by its group: the gateway's
        raise BadKeys(f"{path}: others can read this secret key; chmod 600 it, or better make a new one")
    for name in table.keys() - {"public", "secret", "server"}:
        raise BadKeys(f"{path}: '{name}' is not one of public, secret, server")
    for name in ("public", "secret", *table):
        if not _is_key(table.get(name)):
            raise BadKeys(f"{path}: {name} is not a key: 40 letters of Z85, as tractionctl keys new prints them")
    if zmq.curve_public(table["secret"].encode()).decode() != table["public"]:
        raise BadKeys(f"{path}: the public key does not belong to the secret one")
    return Keys(server_key or table.get("server", ""), table["public"], table["secret"])


def use_keys(socket: "zmq.Socket[bytes]", keys: Keys | None) -> None:
    """Before the socket connects. Raises BadKeys."""
    if keys is None:
        return
    for what, key in (("server key", keys.server_key), ("public key", keys.public_key), ("secret key", keys.secret_key)):
        if not _is_key(key):
            shown = "" if key is keys.secret_key else f" '{key}'"  # the secret one is not for everybody's eyes
            raise BadKeys(f"the {what}{shown} is not a key: 40 letters of Z85")
    socket.curve_serverkey = keys.server_key.encode()
    socket.curve_publickey = keys.public_key.encode()
    socket.curve_secretkey = keys.secret_key.encode()
