"""The targets of figures, as they are printed: "<= 3 mm", ">= 93 %", "93 - 97 %", "0"."""

import math
import re


def bounds(target):
    """The least and the most that a target allows; shares of 1 where it is in percent."""
    sign, first, last, percent = re.match(r"([<>]?)=? ?([\d.]+)(?: [-–] ([\d.]+))? ?(%?)", target).groups()
    first, last = (float(number) / (100 if percent else 1) for number in (first, last or first))
    return (-math.inf if sign == "<" else first), (math.inf if sign == ">" else last)
