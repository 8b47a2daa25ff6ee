"""Reads force fields from tractiond, and asks it things.

    import traction

    for field in traction.fields():
        print(field.resultant_N, field.force_N.shape)

For asyncio: traction.aio. The protocol: docs/protocol.md; this client: docs/clients.md.
"""

from pkgutil import extend_path

# What others make of the .proto files is traction.v1, and stays importable beside this.
__path__ = extend_path(__path__, __name__)

from . import aio  # noqa: E402
from .control import Control, ZeroResult  # noqa: E402
from .decode import Message  # noqa: E402
from .description import (Body, Calibration, Camera, Colour, Description, Gel, Grid, MarkerLayer,  # noqa: E402
                          RefractingSurface, Solver, Zero)
from .errors import (BadEndpoint, BadKeys, Error, Malformed, NoAnswer, NotAllowed, OtherVersion,  # noqa: E402
                     Refused)
from .intake import Mode, Topics  # noqa: E402
from .keys import Keys, load_keys  # noqa: E402
from .messages import (CaptureBound, Contact, ContactPhase, Contacts, Covariance, CriticalPoint, CriticalPointKind, EndCause,  # noqa: E402
                       Field, Finger, FingerState, Flag, Grasp, Header, Interval, Markers, Method, PictureMotion, Preview, PreviewFormat, Slip,
                       SlipModel, SlipState, Solution, TrackedContact)
from .recordings import Recorded, recording  # noqa: E402
from .status import CameraState, Ledger, Status  # noqa: E402
from .subscriber import Subscriber, fields  # noqa: E402

__version__ = "0.1.0"

__all__ = [
    "BadEndpoint", "BadKeys", "Body", "Calibration", "Camera", "CameraState", "CaptureBound", "Colour", "Contact",
    "ContactPhase", "Contacts", "Control", "Covariance", "CriticalPoint", "CriticalPointKind", "Description", "EndCause", "Error", "Field", "Finger",
    "FingerState", "Flag", "Gel", "Grasp", "Grid", "Header", "Interval", "Keys", "Ledger",
    "Malformed", "Markers", "MarkerLayer", "Message", "Method", "Mode", "NoAnswer", "NotAllowed", "OtherVersion",
    "PictureMotion", "Preview", "PreviewFormat", "Recorded", "RefractingSurface", "Refused", "Slip", "SlipModel", "SlipState", "Solution", "Solver", "Status", "Subscriber", "Topics",
    "TrackedContact", "Zero", "ZeroResult", "aio", "fields", "load_keys", "recording",
]
