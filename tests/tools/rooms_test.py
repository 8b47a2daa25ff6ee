"""docs/architecture.md states what the rooms of the tree include, and every thread and exit code of the daemon."""

import os
import pathlib
import re
import unittest

SOURCE = pathlib.Path(__file__).resolve().parents[2]
PARTED = ("client", "daemon")  # their folders are rooms; the files above these are the room on top
ROOMS = ("base", "sensor", "proto", "recording", "gateway", "twin", "lens", *PARTED)


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


def section(title):
    page = (SOURCE / "docs/architecture.md").read_text()
    return re.search(rf"^## {title}\n(.*?)^## ", page, re.M | re.S)[1]


def daemon_code():
    """Returns the text of all C++ files of the daemon and of what it is built on."""
    return "\n".join(path.read_text() for room in ("base", "daemon") for path in sorted((SOURCE / room).rglob("*"))
                     if path.suffix in (".h", ".cpp"))


class Rooms(unittest.TestCase):
    def test_include_what_the_page_says(self):
        said = {room: set(others.split(", ")) for room, others in re.findall(
            r"^ ([\w/]+) +-> ([\w/]+(?:, [\w/]+)*)", (SOURCE / "docs/architecture.md").read_text(), re.M)}
        found = {room: others for room, others in includes().items() if others and room != "daemon"}
        self.assertEqual(found, said)

    def test_name_their_threads_as_the_page_does(self):
        named = re.findall(r'(?:\brun\(\w+, |setname_np\([^"\n]*|PR_SET_NAME, |BackgroundThread>\()"([^"]+)"', daemon_code())
        self.assertGreater(len(named), 10)
        listed = re.findall(r"^\| `([^`]+)` \| ours \|", section("Stages, links, threads"), re.M)
        self.assertEqual(sorted([*listed, "tr-last-will"]), sorted(named))  # a child process, named below the table

    def test_exit_with_the_codes_that_the_page_lists(self):
        used = {getattr(os, name) for name in re.findall(r"\bEX_[A-Z]+\b", daemon_code())}
        listed = {int(code) for code in re.findall(r"^\| (\d+) \|", section("Errors"), re.M)}
        self.assertEqual(used, listed)


if __name__ == "__main__":
    unittest.main()
