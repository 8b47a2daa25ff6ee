"""Damages GenICam descriptions at random, as a bad sector, a careless maker or an attacker would, and tells what tractiond says.

usage: descriptions.py TRACTIOND NUMBER FILE...
Prints each case that tractiond did not bear, keeps its description in build/descriptions, and ends with a line of counts.
Exit codes: 0 it bore all; 8 it crashed, computed for longer than 5 s, or made a plan of a description that is cut short.
"""

import collections
import pathlib
import re
import resource
import subprocess
import sys
import tempfile

import seed

LONGEST_S = 5  # of processor time
HUNG_S = 120
REFERENCE = re.compile(r"<(p[A-Z]\w*)[^>]*>([^<]*)</\1>")
LENGTH = re.compile(r"<Length>([^<]*)<")
NODE = re.compile(r'<(?:Integer|Float|IntReg|IntSwissKnife|SwissKnife|Enumeration|Converter|MaskedIntReg|StringReg) [^>]*'
                  r'Name="([^"]+)"[^>]*>')
LENGTHS = ("9000000000000000000", "2147483648", "-1", "0", "1e9", "0x7fffffff", "16777215")
ELEMENTS = tuple(f"<{name}>{{}}</{name}>" for name in (
    "pValue", "pMin", "pMax", "pInc", "pIsAvailable", "pIsImplemented", "pIsLocked", "pLength", "pAddress", "pIndex",
    "pSelected", "pInvalidator", "pValueDefault", "pValueIndexed", "pValueCopy", "pCommandValue")) + (
    '<pVariable Name="Z">{}</pVariable>',
    '<IntSwissKnife><pVariable Name="V">{}</pVariable><Formula>V</Formula></IntSwissKnife>')


def cut(text, draw):
    """Ends it before its root element does."""
    return text[:draw.randrange(text.rfind("</RegisterDescription"))]


def redirect(text, draw):
    """Lets a reference lead to any node."""
    found = REFERENCE.search(text, draw.randrange(len(text)))
    names = re.findall(r'\bName="([^"]+)"', text)
    return text[:found.start(2)] + draw.choice(names) + text[found.end(2):] if found else text


def refer(text, draw):
    """Gives a node one more reference, to itself or any other."""
    nodes = list(NODE.finditer(text))
    if not nodes:
        return text
    node = draw.choice(nodes)
    element = draw.choice(ELEMENTS).format(draw.choice((node[1], draw.choice(nodes)[1])))
    return text[:node.end()] + element + text[node.end():]


def lengthen(text, draw):
    """Gives a register another length."""
    found = LENGTH.search(text, draw.randrange(len(text)))
    return text[:found.start(1)] + draw.choice(LENGTHS) + text[found.end(1):] if found else text


def group(text, _):
    """Puts all nodes into a group."""
    begin = text.find(">", text.find("<RegisterDescription")) + 1
    end = text.rfind("</RegisterDescription")
    return text[:begin] + '<Group Comment="g">' + text[begin:end] + "</Group>" + text[end:]


DAMAGES = (cut, redirect, redirect, refer, lengthen, group)


def computed_s():
    """Returns the processor time of all children so far."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main(tractiond, number, *files):
    draw = seed.chance("descriptions")
    texts = {}
    for file in files:
        text = pathlib.Path(file).read_text(encoding="utf-8", errors="surrogateescape")
        if "</RegisterDescription" in text:
            texts[pathlib.Path(file).name] = text[text.find("<"):]  # behind what tools print before it
    if not texts:
        sys.exit("descriptions: there is none that is whole")
    counts, kept = collections.Counter(), pathlib.Path("build/descriptions")
    with tempfile.NamedTemporaryFile(suffix=".xml") as spoilt:
        for case in range(int(number)):
            name = draw.choice(sorted(texts))
            text, damages = texts[name], []
            for _ in range(draw.choice((1, 1, 2, 3, 8))):
                damages.append(draw.choice(DAMAGES))
                text = damages[-1](text, draw)
                if damages[-1] is cut:
                    break
            pathlib.Path(spoilt.name).write_text(text, encoding="utf-8", errors="surrogateescape")
            try:
                before_s = computed_s()
                done = subprocess.run([tractiond, "--plan", spoilt.name], capture_output=True, timeout=HUNG_S)
                what = {0: "plans", 78: "refusals"}.get(done.returncode, "not opened")
                if done.returncode < 0 or done.returncode > 128:
                    what = "CRASHES"
                elif computed_s() - before_s > LONGEST_S:
                    what = "HANGS"
                elif done.returncode == 0 and cut in damages:
                    what = "PLANS OF WHAT IS CUT SHORT"
                elif b"crashes what evaluates it" in done.stderr:
                    what = "not opened, as evaluating it crashed the child"
                elif b"than any camera's" in done.stderr:
                    what = "not opened, as evaluating it kept the child busy"
            except subprocess.TimeoutExpired:
                what = "HANGS"
            counts[what] += 1
            if what.isupper():
                kept.mkdir(parents=True, exist_ok=True)
                (kept / f"{case}.xml").write_text(text, encoding="utf-8", errors="surrogateescape")
                print(f"{what}: case {case}, {name}: {', '.join(damage.__name__ for damage in damages)}; build/descriptions/{case}.xml")
    print(f"{number} damaged descriptions of {len(texts)}, target 0 crashes, hangs and plans of what is cut short: " +
          ", ".join(f"{count} {what}" for what, count in sorted(counts.items())))
    return 8 if any(what.isupper() for what in counts) else 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
