"""Draws mutations at random: one condition, constant or call of the simulated parts that is removed."""

import collections
import pathlib
import re

import seed

SOURCE = pathlib.Path(__file__).resolve().parents[2]

# File: the unit tests of the part: a program of the release build, and GoogleTest's filter.
CAPTURE, PROCEDURES = ("capture", "-ClockSimulation.*:GvcpSearch.*"), ("procedures", "-*WhateverHappens*")
POSES, PUBLISH = ("track", "RestPoseFile.*"), ("publish", "*")
PARTS = {
    "daemon/capture/camera.cpp": CAPTURE,
    "daemon/capture/keeper.cpp": CAPTURE,
    "daemon/capture/frame_gate.cpp": CAPTURE,
    "daemon/capture/intake.cpp": CAPTURE,
    "daemon/capture/device_clock.cpp": CAPTURE,
    "daemon/app/pipeline.cpp": ("pipeline", "*"),
    "daemon/app/prompt_solver.cpp": ("prompt_solver", "*"),
    "daemon/publish/publisher.cpp": PUBLISH,
    "daemon/control/control_server.cpp": ("control", "*"),
    "base/network/socket.cpp": ("network", "*"),
    "base/network/socket_file.cpp": ("network", "*"),
    "base/network/keys.cpp": ("keys", "*"),
    "gateway/front.cpp": ("gateway", "*"),
    "gateway/handshake.cpp": ("gateway", "*"),
    "gateway/keys.cpp": ("gateway", "*"),
    "gateway/messages.cpp": ("gateway", "*"),
    "gateway/rates.h": ("gateway", "*"),
    "gateway/relay.cpp": ("gateway", "*"),
    "gateway/request.cpp": ("gateway", "*"),
    "base/link.h": ("base", "*"),
    "base/service/service.h": ("service", "*"),
    "base/service/service_loop.cpp": ("service", "*"),
    "base/whole_file.h": POSES,
    "daemon/control/procedures.cpp": PROCEDURES,
    "daemon/app/reload.cpp": ("reload", "*"),
    "daemon/control/zero_procedure.cpp": PROCEDURES,
    "daemon/control/zero_writer.cpp": PROCEDURES,
    "daemon/control/zero_store.cpp": POSES,
    "daemon/track/rest_pose_file.cpp": POSES,
    "daemon/control/step_runner.cpp": PROCEDURES,
}

# `line` counts from 1; `old` is the whole line, `new` what it becomes.
Mutation = collections.namedtuple("Mutation", "file line kind old new program filter")


def closing(text, at):
    """Returns the index of the bracket that closes the one at `at`; None: it is not on this line."""
    depth = 0
    for i in range(at, len(text)):
        depth += {"(": 1, ")": -1}.get(text[i], 0)
        if depth == 0:
            return i
    return None


def conditions(line):
    """Yields the line with a condition that holds always, or never."""
    for found in re.finditer(r"\b(?:if|while) \(", line):
        begin = found.end() - 1
        end = closing(line, begin)
        inner = line[begin + 1:end] if end else ";"
        if ";" in inner or re.match(r"(?:const|auto|int|T\*) ?", inner) or " = " in inner:
            continue
        yield from (f"{line[:begin]}({word} ({inner}){line[end:]}" for word in ("true ||", "false &&"))


def constants(line):
    """Yields the line with a number that is 0; 1 where it was 0."""
    for found in re.finditer(r"(?<![\w.'\"<{])\d[\d']*(?:\.\d+)?(?:e\d+)?(?![\w.'\"x>])", line):
        new = "1" if float(found[0].replace("'", "")) == 0 else "0"
        yield line[:found.start()] + new + line[found.end():]


def calls(line):
    """Yields the line without its call or assignment, if it is a whole statement."""
    if re.match(r"^ +(?!return\b|const\b|auto\b|using\b|static|if\b|for\b|else\b|while\b|break\b)[\w:.>*\[\]-]+(?:\(.*\)| [-+|]?= .*);$", line) \
            and line.count("(") == line.count(")"):
        yield re.match(r" +", line)[0] + ";"


def sites():
    """Returns all mutations that can be drawn."""
    found = []
    for file, tests in PARTS.items():
        for number, line in enumerate((SOURCE / file).read_text().splitlines(), 1):
            code = re.sub(r" *//.*", "", line)
            if not code.strip() or code.lstrip().startswith(("#", "static_assert", "assert")) or '"' in code:
                continue
            for kind in (conditions, constants, calls):
                found += [Mutation(file, number, kind.__name__[:-1], line, new, *tests) for new in kind(code)]
    return found


def edit(project, one):
    """Returns the edit of a mutation, see mutations.made(): of the whole file, as its line may stand there twice."""
    lines = (project / one.file).read_text().splitlines(keepends=True)
    changed = [*lines[:one.line - 1], one.new + "\n", *lines[one.line:]]
    return one.file, "".join(lines), "".join(changed)


def drawn(number):
    """Draws mutations, in the order in which they are to be made. Twice `number`, as some do not compile."""
    all_of_them = sites()
    return seed.chance("mutations").sample(all_of_them, min(2 * number, len(all_of_them)))
