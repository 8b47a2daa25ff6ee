"""What the client raises."""

from typing import ClassVar


class Error(Exception):
    """Anything that went wrong between here and tractiond; one sentence for people."""

    code: ClassVar[str] = "error"


class BadEndpoint(Error):
    """No such endpoint or instance name."""

    code = "bad_endpoint"


class NoAnswer(Error, TimeoutError):
    """Nobody answered, or nothing came, in time."""

    code = "no_answer"


class OtherVersion(Error):
    """The daemon speaks another version of the protocol."""

    code = "version"


class Malformed(Error):
    """What arrived is no message of the protocol."""

    code = "malformed"


class Refused(Error):
    """The daemon could not do it; the text is its sentence."""

    code = "refused"


class BadKeys(Error):
    """What was given as keys is none, or their file cannot be read."""

    code = "bad_keys"


class NotAllowed(Error):
    """A gateway does not let this side in, or not to this."""

    code = "not_allowed"
