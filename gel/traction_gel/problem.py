"""What is wrong with the input, for people."""


class Problem(Exception):
    """A message: what is wrong, where, and what to do."""
