"""The rooms of the tree include of each other what docs/architecture.md says."""

import graphlib
import pathlib
import re
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
PARTED = ("client", "daemon")  # their folders are rooms
ROOMS = ("base", "sensor", "touch", "proto", "recording", "gateway", "twin", "lens", *PARTED)


def room_of(path):
    """Returns the room of a file; None for generated headers, the public ones of the client, and files of no room."""
    parts = pathlib.PurePosixPath(path).parts
    if len(parts) == 1 or parts[0] not in ROOMS:
        return None
    return "/".join(parts[:2]) if parts[0] in PARTED and len(parts) > 2 else parts[0]


def includes():
    """Returns {room: the other rooms of which it includes a file}."""
    found = {}
    for path in (path for room in ROOMS for path in (SOURCE / room).rglob("*") if path.suffix in (".h", ".cpp")):
        room = room_of(path.relative_to(SOURCE).as_posix())
        others = {room_of(name) for name in re.findall(r'^#include "([^"]+)"', path.read_text(), re.M)}
        found.setdefault(room, set()).update(others - {room, None})
    return found


class Rooms(unittest.TestCase):
    def test_include_what_the_page_says(self):
        said = {room: set(others.split(", ")) for room, others in re.findall(
            r"^ ([\w/]+) +-> ([\w/]+(?:, [\w/]+)*)", (SOURCE / "docs/architecture.md").read_text(), re.M)}
        found = {room: others for room, others in includes().items() if others}
        self.assertEqual(found, said)

    def test_include_only_what_lies_below(self):
        graphlib.TopologicalSorter(includes()).prepare()  # raises where there is a circle

    def test_threads_are_those_of_the_page(self):
        page = (SOURCE / "docs/architecture.md").read_text()
        said = {name for cell in re.findall(r"^\| (`.+`) \| ours \|", page, re.M) for name in re.findall(r"`(.+?)`", cell)}
        code = "".join(path.read_text() for room in ("base", "daemon")
                       for path in (SOURCE / room).rglob("*") if path.suffix in (".h", ".cpp"))
        self.assertEqual(set(re.findall(r'"((?:tr|camera)-[a-z-]+)"', code)), said)
