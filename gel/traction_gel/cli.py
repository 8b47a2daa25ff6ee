"""Runs traction-gel."""

import pathlib
import sys
import traceback

from . import command_line
from .problem import Problem

DATA_ERROR, NO_INPUT, FAILED, CANNOT_CREATE, INTERRUPTED = 65, 66, 70, 73, 130


class Reporter:
    """Says on standard error how far the work is; a line that replaces another only where a person looks on."""

    def __init__(self):
        self.open = False

    def __call__(self, text, again):
        if again and not sys.stderr.isatty():
            return
        begin = "\r" if self.open and again else "\n" if self.open else ""
        print(begin + text, end="" if again else "\n", file=sys.stderr, flush=True)
        self.open = again

    def close(self):
        """Ends a line that is still open."""
        if self.open:
            print(file=sys.stderr)
        self.open = False


def mesh(options, say):
    """Runs `traction-gel mesh`."""
    from . import check, files, influence  # gmsh and GetFEM: --help does not need them

    path = pathlib.Path(options.description)
    task = files.read(path)
    if options.check:
        check.available()
    result = influence.compute(task, path.parent, say)
    if options.check:
        check.check(task, result, path.parent, say)
    written = files.write(task, result, options.output or path.stem)
    say(f"estimated error {result.error_percent:.2f} % of the peak; wrote {', '.join(map(str, written))}", False)


def mould(options, say):
    """Runs `traction-gel mould`."""
    from . import files
    from . import mould as drawings

    path = pathlib.Path(options.description)
    written = drawings.write(files.read(path), options.output or path.stem, say)
    say(f"wrote {', '.join(map(str, written))}", False)


def main(version, arguments=None):
    """Returns the exit code."""
    options = command_line.parse(arguments, version)
    say = Reporter()
    try:
        {"mesh": mesh, "mould": mould}[options.command](options, say)
        return 0
    except Problem as problem:
        code, text = DATA_ERROR if pathlib.Path(options.description).exists() else NO_INPUT, str(problem)
    except MemoryError as error:
        code, text = DATA_ERROR, str(error) or "too little memory: raise error_percent"
    except OSError as error:
        code, text = CANNOT_CREATE, str(error)
    except KeyboardInterrupt:
        code, text = INTERRUPTED, "interrupted; nothing was written"
    except Exception as error:  # of gmsh, GetFEM, CHOLMOD: their own classes
        place = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{type(error).__name__} in {pathlib.Path(place.filename).name}, line {place.lineno}"
        code, text = FAILED, (
            f"unexpected: {' '.join(str(error).split())} ({where}); nothing was written. Does the shape have parts much thinner "
            "than its markers are deep? If not, please report it, with the description and its files"
        )
    say.close()
    print(f"{command_line.NAME}: {text}", file=sys.stderr)
    return code
