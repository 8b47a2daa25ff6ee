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


LIBRARIES = {  # as the page names them: what an include of it contains
    "Aravis": r"<arv\.h>", "ZeroMQ": r"<zmq", "Protobuf": r"google/protobuf|\.pb\.h", "toml++": r"<toml", "BLAS and LAPACK": r"cblas|lapack",
    "OpenCV": r"opencv2", "Boost, nlohmann-json, libturbojpeg": r"<boost|<nlohmann|jpeg"}


def includes():
    """Returns {room: the other rooms of which it includes a file}."""
    found = {}
    for path in (path for room in ROOMS for path in (SOURCE / room).rglob("*") if path.suffix in (".h", ".cpp")):
        room = room_of(path.relative_to(SOURCE).as_posix())
        others = {room_of(name) for name in re.findall(r'^#include "([^"]+)"', path.read_text(), re.M)}
        found.setdefault(room, set()).update(others - {room, None})
    return found


class Rooms(unittest.TestCase):
    maxDiff = None

    def test_include_what_the_page_says(self):
        said = {room: set(others.split(", ")) for room, others in re.findall(
            r"^ ([\w/]+) +-> ([\w/]+(?:, [\w/]+)*)", (SOURCE / "docs/architecture.md").read_text(), re.M)}
        found = {room: others for room, others in includes().items() if others}
        self.assertEqual(found, said)

    def test_include_only_what_lies_below(self):
        graphlib.TopologicalSorter(includes()).prepare()  # raises where there is a circle

    def test_include_the_libraries_that_the_page_says(self):
        page, found = (SOURCE / "docs/architecture.md").read_text(), {}
        for path in (path for room in ROOMS for path in (SOURCE / room).rglob("*") if path.suffix in (".h", ".cpp")):
            lines = "\n".join(re.findall(r"^#include .*", path.read_text(), re.M))
            for library in (name for name, pattern in LIBRARIES.items() if re.search(pattern, lines)):
                found.setdefault(library, set()).add(room_of(path.relative_to(SOURCE).as_posix()))
        said = {name: set(re.findall(r"`([^`]+)`", rooms)) for name, rooms in re.findall(r"^\| ([^|`]+) \| (`[^|]+) \|$", page, re.M)}
        self.assertEqual(found, {name: rooms for name, rooms in said.items() if name in LIBRARIES})

    def test_files_and_functions_of_the_page_exist(self):
        page = (SOURCE / "docs/architecture.md").read_text()
        for name in re.findall(r"`((?:%s)/[\w./]+\.(?:h|cpp|py|toml))`" % "|".join([*ROOMS, "tests", "config", "manual"]), page):
            self.assertTrue((SOURCE / name).exists(), name)
        code = "".join(path.read_text() for path in (SOURCE / "daemon").rglob("*.h"))
        for kind, function in re.findall(r"`([A-Z]\w+)::(\w+)`", page):
            self.assertRegex(code, rf"(?s)class {kind}\b[^;]*\{{.*?\b{function}\(")

    def test_threads_are_those_of_the_page(self):
        page = (SOURCE / "docs/architecture.md").read_text()
        said = {name for cell in re.findall(r"^\| (`.+`) \| ours \|", page, re.M) for name in re.findall(r"`(.+?)`", cell)}
        code = "".join(path.read_text() for room in ("base", "daemon")
                       for path in (SOURCE / room).rglob("*") if path.suffix in (".h", ".cpp"))
        self.assertEqual(set(re.findall(r'"((?:tr|camera)-[a-z-]+)"', code)), said)
