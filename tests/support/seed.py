"""The one source of chance in the tests. Twin: seed.h."""

import functools
import os
import random
import secrets
import sys
import unittest

FIXED = 20050125  # seed of every run in which TRACTION_SEED is not set, the gate's among them


def _given():
    """Returns the number in the environment variable TRACTION_SEED, or None. Ends the program with 64 if it is no number."""
    text = os.environ.get("TRACTION_SEED")
    if text is None:
        return None
    if not (text.isascii() and text.isdigit() and int(text) < 2**32):
        print(f"TRACTION_SEED is '{text}', must be a whole number below 2^32", file=sys.stderr)
        sys.exit(64)
    return int(text)


SEED = FIXED if _given() is None else _given()


def chance(*names):
    """Returns a random.Random for the draws of one test. `names` (for example the test's id) make its draws independent of
    those of others; the same names and seed give the same draws. Prints what repeats them."""
    print(f"\n  seed {SEED}: repeat with TRACTION_SEED={SEED}", flush=True)
    return random.Random(" ".join(map(str, (SEED, *names))))


def fresh():
    """Returns a new seed below 2^32 for a program that is to see other inputs each time, or TRACTION_SEED."""
    return secrets.randbelow(2**32) if _given() is None else _given()


class TestCase(unittest.TestCase):
    """One whose draws are its own."""

    @functools.cached_property
    def draw(self):
        return chance(self.id())
