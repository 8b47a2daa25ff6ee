"""The arrays of messages: which numbers they hold, in which shape. What travels packed is a read-only view of those bytes."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True)
class Packed:
    """An array that lies in the message as NumPy has it; -1: as many as came. A fixed shape is 0 where none came."""

    dtype: str
    shape: tuple[int, ...]


@dataclass(frozen=True)
class Axes:
    """Two or three numbers that the message holds by their names."""

    names: str


@dataclass(frozen=True)
class OneByteEach:
    """A byte an element: 1 or 0."""


@dataclass(frozen=True)
class SixteenBytes:
    """A hash or random; empty: none."""


@dataclass(frozen=True)
class Bytes:
    """As they are; their shape is in other members."""


Id = Annotated[bytes, SixteenBytes()]
Mask = Annotated[NDArray[np.bool_], OneByteEach()]
Pixels = Annotated[NDArray[np.uint8], Bytes()]
Vector2 = Annotated[NDArray[np.float64], Axes("xy")]
Vector3 = Annotated[NDArray[np.float64], Axes("xyz")]
Matrix3 = Annotated[NDArray[np.float64], Packed("<f8", (3, 3))]
Numbers = Annotated[NDArray[np.float32], Packed("<f4", (-1,))]
Doubles = Annotated[NDArray[np.float64], Packed("<f8", (-1,))]
Vectors2 = Annotated[NDArray[np.float32], Packed("<f4", (-1, 2))]
Vectors3 = Annotated[NDArray[np.float32], Packed("<f4", (-1, 3))]
