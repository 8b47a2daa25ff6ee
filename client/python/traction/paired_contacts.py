"""Gives each contact that begins its end, also where messages were lost, or traction-touch was killed."""

from dataclasses import replace

import numpy as np

from .messages import ContactPhase, Contacts, Covariance, EndCause, TrackedContact


def _end_of(contact: TrackedContact, cause: EndCause) -> TrackedContact:
    """The end of a contact, without what holds only while it is seen."""
    none = Covariance(np.zeros((3, 3)), np.zeros((3, 3)))
    return replace(contact, phase=ContactPhase.END, end_cause=cause, force_N=np.zeros(3), force_deviation_N=np.zeros(3),
                   velocity_m_s=np.zeros(2), velocity_deviation_m_s=np.zeros(2), slip=None, moment_Nm=np.zeros(3),
                   force_covariance_N2=none, moment_covariance_N2m2=none, force_moment_covariance_N2m=none,
                   angular_velocity_rad_s=0.0, angular_velocity_deviation_rad_s=0.0)


class PairedContacts:
    """The contacts of one topic, as the messages that a subscriber has received leave them."""

    def __init__(self) -> None:
        self._last: Contacts | None = None
        self._open: dict[int, TrackedContact] = {}  # that have begun and not ended

    @property
    def are_open(self) -> bool:
        return bool(self._open)

    def complete(self, contacts: Contacts) -> None:
        """Takes the next message, and changes it so that begins and ends pair: adds, first, the ends of those that have
        begun and are of another run or missing in it; lets one that has not begun begin where it is seen; leaves out
        others."""
        is_same_run = self._last is not None and self._last.run == contacts.run
        listed = {one.id for one in contacts.contacts} if is_same_run else set()
        cause = EndCause.NOT_SEEN if is_same_run else EndCause.STOPPED
        all = [_end_of(self._open.pop(id), cause) for id in sorted(self._open.keys() - listed)]
        for one in contacts.contacts:
            is_seen = one.phase in (ContactPhase.BEGIN, ContactPhase.MOVE)
            if one.id not in self._open and not is_seen:
                continue
            if is_seen:
                one.phase = ContactPhase.MOVE if one.id in self._open else ContactPhase.BEGIN
            all.append(one)
            self._open[one.id] = one
            if one.phase is ContactPhase.END:
                del self._open[one.id]
        contacts.contacts = tuple(all)
        self._last = contacts

    def end_all(self, now_ns: int) -> Contacts:
        """A message with the ends of all that have begun; its header is that of the last message."""
        assert self._last is not None
        ends = tuple(_end_of(one, EndCause.NOT_SEEN) for one in self._open.values())
        self._open.clear()
        return replace(self._last, header=replace(self._last.header, arrived_ns=now_ns), valid=False, contacts=ends,
                       critical_points=())
