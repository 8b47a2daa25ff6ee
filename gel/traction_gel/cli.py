"""The command line of traction-gel."""

import argparse
import pathlib
import sys

from . import files
from .problem import Problem

DATA_ERROR, NO_INPUT, CANNOT_CREATE, INTERRUPTED = 65, 66, 73, 130


def parser():
    """Returns the parser of the command line."""
    result = argparse.ArgumentParser(
        prog="traction-gel", description="Makes the influence file and the gel file of a gel of any shape, for tractiond."
    )
    commands = result.add_subparsers(dest="command", required=True, metavar="COMMAND")
    mesh = commands.add_parser("mesh", help="compute influence file, gel file and a picture from a description")
    mesh.add_argument("description", type=pathlib.Path, metavar="FILE.toml", help="shape, material, markers and nodes")
    mesh.add_argument("--output", type=pathlib.Path, metavar="NAME",
                      help="of what is written: NAME.npz, NAME_gel.toml, NAME.png; default: FILE, in this folder")  # fmt: skip
    mesh.add_argument("--no-picture", action="store_true", help="write no NAME.png")
    return result


class Reporter:
    """Says on standard error how far the work is; a line that replaces another only where a person looks on."""

    def __init__(self):
        self.open = False

    def __call__(self, text, again):
        if again and not sys.stderr.isatty():
            return
        print(("\r" if self.open and again else "\n" if self.open else "") + text, end="" if again else "\n",
              file=sys.stderr, flush=True)  # fmt: skip
        self.open = again

    def close(self):
        """Ends a line that is still open."""
        if self.open:
            print(file=sys.stderr)
        self.open = False


def mesh(options, say):
    """Runs `traction-gel mesh`."""
    task = files.read(options.description)
    from . import influence  # after the input was read: these load for a second

    result = influence.compute(task, options.description.parent, say)
    draw = None
    if not options.no_picture:
        from .picture import draw
    written = files.write(task, result, options.output or options.description.stem, draw)
    say(f"estimated error {result.error_percent:.2f} % of the peak; wrote {', '.join(map(str, written))}", False)


def main(arguments=None):
    """Returns the exit code."""
    options = parser().parse_args(arguments)
    say = Reporter()
    try:
        mesh(options, say)
        return 0
    except Problem as problem:
        code, text = DATA_ERROR if options.description.exists() else NO_INPUT, str(problem)
    except MemoryError as error:
        code, text = DATA_ERROR, str(error) or "too little memory: raise error_percent"
    except OSError as error:
        code, text = CANNOT_CREATE, str(error)
    except KeyboardInterrupt:
        code, text = INTERRUPTED, "interrupted; nothing was written"
    say.close()
    print(f"traction-gel: {text}", file=sys.stderr)
    return code
