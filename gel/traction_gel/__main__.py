"""Lets `python3 -m traction_gel` run the program."""

import sys

from .cli import main

sys.exit(main())
