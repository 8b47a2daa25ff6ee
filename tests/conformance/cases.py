"""What is sent to a reader, and what he must say of it. A case is a list of (parts of a message, what comes of it):
a dict, the message in the form of form.py; the name of an error; None: nothing, it is passed over."""

import math

import numpy as np

from contract import draw, encode, key, run
from form import echo, plain

KINDS = ("Field", "Markers", "Description", "Status", "Preview", "Contacts", "Grasp")


def topic(sensor, kind):
    return f"traction/v1/{sensor}/{kind.lower()}/".encode()


class Sender:
    """One case's sensor: its name, the start of its daemon, and how far each topic is."""

    def __init__(self, chance, number):
        self.chance, self.sensor = chance, f"case-{number}"
        self.boot, self.sequence = chance.randbytes(16), {}

    def make(self, name="Field", skip=0, count=None):
        """A message with the next number of its topic but `skip`."""
        values = draw(name, self.chance, count)
        at = self.sequence.get(name, self.chance.randrange(1, 1000) - 1) + 1 + skip
        self.sequence[name] = at
        if name == "Contacts":  # clients let each that begins end
            values["contacts"] = [{**draw("TrackedContact", self.chance), "id": id, "phase": phase}
                                  for id in range(self.chance.randrange(3)) for phase in (1, self.chance.choice([2, 3, 4, 77]), 5)]
        values["header"] = {**draw("Header", self.chance), "sequence": at, "boot": self.boot, "sensor": self.sensor}
        return {"timestamp": 1.0, **values}

    def parts(self, name, payload):
        return [topic(self.sensor, name), payload, b"1.000000000"]

    def good(self, name="Field", **options):
        values = self.make(name, **options)
        return self.parts(name, encode(name, values, self.chance)), echo(name.lower(), plain(name, values))

    def damaged(self, name, change):
        """`change` of the message's members, or of its bytes. It arrives and is refused: it is no loss."""
        values = self.make(name, count=self.chance.randrange(1, 40))
        before = dict(self.sequence)
        changed = change(values)
        self.sequence = {**before, name: before[name] - 1}  # the next good one has its number
        return self.parts(name, changed if isinstance(changed, bytes) else encode(name, values)), "malformed"


# What a contact does not say once it is not seen.
UNSEEN = {"force_N", "force_deviation_N", "velocity_m_s", "velocity_deviation_m_s", "slip", "moment_Nm", "force_covariance_N2",
          "moment_covariance_N2m2", "force_moment_covariance_N2m", "angular_velocity_rad_s", "angular_velocity_deviation_rad_s"}
BEGIN, MOVE, ABSENT, UNKNOWN, END = range(1, 6)
NOT_SEEN, STOPPED = 3, 5  # end_cause


def paired(one):
    """Contacts of which each that begins ends once, whatever is lost: what is sent, and what a client says of it."""
    runs, last, steps = [one.chance.randbytes(16) for _ in range(2)], {}, []
    for run, sent, expected in (
            (0, {1: MOVE, 2: ABSENT}, {1: BEGIN}),  # it came late
            (0, {1: BEGIN, 2: MOVE}, {1: MOVE, 2: BEGIN}),
            (0, {2: ABSENT, 3: BEGIN}, {1: END, 2: ABSENT, 3: BEGIN}),  # the end of the first was lost
            (0, {2: 77, 3: UNKNOWN}, {2: 77, 3: UNKNOWN}),  # of a later version
            (1, {4: BEGIN, 5: UNKNOWN}, {2: END, 3: END, 4: BEGIN}),  # another start of traction-touch
            (1, {4: END}, {4: END}),
            (1, {4: END}, {})):
        values = one.make("Contacts")
        values.update(run=runs[run], contacts=[{**draw("TrackedContact", one.chance), "id": id, "phase": phase}
                                               for id, phase in sent.items()])
        drawn = {contact["id"]: contact for contact in values["contacts"]}
        cause = NOT_SEEN if run == 0 else STOPPED
        ends = {id: {**{name: value for name, value in contact.items() if name not in UNSEEN}, "end_cause": cause}
                for id, contact in last.items()}
        said = [{**(drawn.get(id) or ends[id]), "phase": phase} for id, phase in expected.items()]
        last |= drawn
        steps.append((one.parts("Contacts", encode("Contacts", values, one.chance)),
                      echo("contacts", plain("Contacts", {**values, "contacts": said})), 0))
    return steps


def silent(one):
    """A contact that begins, and its end after a silence, as a client says it."""
    values = one.make("Contacts")
    contact = {**draw("TrackedContact", one.chance), "id": 1, "phase": BEGIN}
    values.update(contacts=[contact])
    end = {**{name: value for name, value in contact.items() if name not in UNSEEN}, "phase": END, "end_cause": NOT_SEEN}
    return one.parts("Contacts", encode("Contacts", values, one.chance)), *(
        echo("contacts", plain("Contacts", each)) for each in (values, {**values, "valid": False, "contacts": [end], "critical_points": []}))


def with_member(**members):
    return lambda values: values.update(members)


def poison(chance, bad):
    """One number of a field is NaN or infinite."""
    def change(values):
        where = chance.choice(["force_N", "node_deviation_N", "resultant_N", "moment_Nm", "residual_px", "contacts",
                               "resultant_covariance_N2", "picture_motion"])
        if where == "residual_px":
            values[where] = bad
        elif where == "contacts":
            values[where] = [{"force_N": {"y": bad}}]
        elif where == "resultant_covariance_N2":
            values[where] = {chance.choice(["noise", "systematic"]): [0.0] * 8 + [bad]}
        elif where == "picture_motion":
            values[where] = {chance.choice(["scale", "roll_rad"]): bad}
        elif where.endswith("_N") and where != "resultant_N":
            values[where] = [0.0] * (3 * len(values["node_valid"]))
            values[where][chance.randrange(len(values[where]))] = bad
        else:
            values[where] = {chance.choice("xyz"): bad}
    return change


def truncated(chance, name):
    """Cut within its last member."""
    def change(values):
        whole = encode(name, values)
        return whole + run(2000, bytes(20))[:-chance.randrange(1, 20)]
    return change


def damages(chance):
    """name -> (message, change)"""
    bad = chance.choice([math.nan, math.inf, -math.inf])
    single = [np.float32(0)]
    return {
        "truncated field": ("Field", truncated(chance, "Field")),
        "truncated status": ("Status", truncated(chance, "Status")),
        "not Protobuf": ("Field", lambda values: b"\xff\xff\xff\xff"),
        "a wire type that there is none": ("Markers", lambda values: encode("Markers", values) + key(77, 7)),
        "an end of a group that did not begin": ("Field", lambda values: key(1, 1) + bytes(8) + key(77, 4) + encode(
            "Field", values)),
        "an id of other than 16 bytes": ("Field", lambda values: values["header"].update(
            {chance.choice(["boot", "zero", "calibration"]): chance.randbytes(chance.choice([1, 15, 17]))})),
        "text that is no UTF-8": ("Field", lambda values: encode("Field", values) + run(2, run(2, b"\xff\xfe"))),
        "a vector without its last number": ("Field", lambda values: values["force_N"].pop() and None),
        "half a number": ("Field", lambda values: encode("Field", values) + run(4, bytes(6))),
        "a mask of another size": ("Field", lambda values: values.update(node_valid=values["node_valid"] + b"\1")),
        "deviations of another size": ("Field", lambda values: values.update(
            node_deviation_N=single * (3 * len(values["node_valid"]) + 3))),
        "a covariance of 8 numbers": ("Field", with_member(moment_covariance_N2m2={"noise": [1.0] * 8})),
        "a number of a field that is not finite": ("Field", poison(chance, bad)),
        "a displacement that is not finite": ("Markers", lambda values: values.update(
            displacement_px=[bad] + single * (2 * len(values["marker_valid"]) - 1))),
        "variances of another size": ("Markers", lambda values: values.update(variance_px2=values["variance_px2"] + single)),
        "a rest pose with a mask of another size": ("Description", with_member(
            zero={"rest_position_px": single * 4, "marker_present": b"\1"})),
        "a body with other sizes": ("Description", with_member(body={"node_positions_m": single * 3})),
        "a number of a lasting contact that is not finite": ("Contacts", with_member(
            contacts=[{"phase": 1, **chance.choice([{"radius_m": bad}, {"velocity_m_s": {"y": bad}}, {"angular_velocity_rad_s": bad},
                                                       {"moment_covariance_N2m2": {"noise": [bad] * 9}}])}])),
        "a number of a critical point that is not finite": ("Contacts", with_member(
            critical_points=[chance.choice([{"strength": bad}, {"position_m": {"y": bad}}])])),
        "a number of a grasp that is not finite": ("Grasp", with_member(
            **chance.choice([{"force_N": {"z": bad}}, {"moment_covariance_N2m2": {"systematic": [bad] * 9}},
                             {"fingers": [{}, {"moment_Nm": {"x": bad}}]}]))),
        "a picture of another size": ("Preview", lambda values: values.update(
            {chance.choice(["width", "height"]): 13, "pixels": values["pixels"] + b"\0"})),
        "a picture of which the product of the sizes overflows": ("Preview", with_member(
            width=2**31, height=2**31, format=chance.choice([1, 2]), pixels=b"")),
        "a picture of another format": ("Preview", with_member(format=chance.choice([0, 77]))),
        "a picture's place that is not finite": ("Preview", with_member(
            **chance.choice([{"scale": bad}, {"origin_px": {"y": bad}}]))),
        **{f"a number of a description's {part} that is not finite": ("Description", with_member(**members))
           for part, members in {
               "gel": {"gel": chance.choice([{"youngs_modulus_Pa": bad}, {"size_m": {"y": bad}}])},
               "layers": {"layers": [{}, chance.choice([{"pitch_m": bad}, {"centre_m": {"x": bad}}, {"depth_m": bad}])]},
               "nodes": {"nodes": chance.choice([{"pitch_m": bad}, {"centre_m": {"y": bad}}])},
               "camera": {"camera": chance.choice([{"focal_px": bad}, {"aspect": bad}, {"principal_px": {"x": bad}},
                                                   {"rotation_rad": {"z": bad}}, {"window_thickness_m": bad},
                                                   {"surfaces": [{}, {"radii_m": {"y": bad}}]}])},
               "zero": {"zero": {"rest_position_px": [0.0, bad], "marker_present": b"\1"}},
               "body": {"body": {"marker_positions_m": [0.0, bad, 0.0]}},
           }.items()},
        "a histogram without a count": ("Status", with_member(
            latencies={"total": {"since_start": {"bound_s": [1.0, 2.0], "count": [1, 2]}}})),
    }


def stream(chance):
    """name -> case, each with a sensor of its own; in all of them `lost` is told, too."""
    cases = {}
    number = iter(range(10**6))

    def sender():
        return Sender(chance, next(number))

    for name in KINDS:
        one = sender()
        cases[f"good: {name}"] = [(*one.good(name), 0) for _ in range(5)]
    one = sender()
    cases["good: of full size"] = [(*one.good("Field", count=576), 0), (*one.good("Markers", count=1152), 0)]
    for what, (name, change) in damages(chance).items():
        one = sender()
        cases[what] = [(*one.good(name), 0), (*one.damaged(name, change), 0), (*one.good(name), 0)]
    one, skips = sender(), [chance.choice([0, 0, 1, chance.randrange(2, 10**6)]) for _ in range(10)]
    cases["gaps in the sequence"] = [(*one.good(skip=0), 0)] + [(*one.good(skip=skip), skip) for skip in skips]
    one = sender()
    cases["each topic counts for itself"] = [(*one.good(chance.choice(KINDS)), 0) for _ in range(12)]
    one, other = sender(), sender()
    cases["two sensors"] = [(*chance.choice([one, other]).good(), 0) for _ in range(12)]
    one = sender()
    before = [(*one.good(), 0) for _ in range(3)]
    one.boot, one.sequence = chance.randbytes(16), {"Field": chance.choice([0, 10**6])}
    cases["another start of the daemon"] = before + [(*one.good(), 0), (*one.good(skip=2), 2)]
    one = sender()
    again = one.good()
    cases["contacts begin and end in pairs"] = paired(sender())
    cases["the same twice"] = [(*again, 0), (*again, 0), (*one.good(), 0)]
    one = sender()
    parts, said = one.good()
    cases["more parts than three"] = [(parts + [b"more", b""], said, 0)]
    cases["a topic without a message"] = [([topic("x", "field")], "malformed", 0)]
    cases["another version"] = [([chance.choice([b"traction/v2/gel/field/", b"traction/", b"truth/", b"\x1b[2J/"]), b"", b"0.0"],
                                 "version", 0)]
    cases["no topic: latest instead of stream"] = [([encode("Field", one.make())], "bad_endpoint", 0)]
    cases["topics of a later daemon"] = [([name, b"\xff", b"0.0"], None, 0) for name in (
        b"traction/v1/gel/slips/", b"traction/v1/gel", b"traction/v1//", b"traction/v1/gel/field", b"traction/v1/a/b/field/")]
    return cases


def latest(chance):
    """Fields alone, in one part; nothing is ever lost."""
    one, cases = Sender(chance, 0), {}

    def good():
        values = one.make(skip=chance.choice([0, 5]))
        return [encode("Field", values, chance)], echo("field", plain("Field", values)), 0

    cases["good"] = [good() for _ in range(5)]
    for what, (name, change) in damages(chance).items():
        if name == "Field" and what != "not Protobuf":  # which does not begin as a field does, and never arrives
            parts, said = one.damaged(name, change)
            cases[what] = [([parts[1]], said, 0), good()]
    return cases


def control(chance):
    """name -> (what is asked, bytes of the reply or None, what comes of it)"""
    def reply(members):
        return encode("Reply", {"version": 1, **members}, chance)

    cases = {}
    for what, kind, name in (("status", "status", "Status"), ("describe", "description", "Description"),
                             ("zero", "zero", "ZeroReply"), ("undo", "zero", "ZeroReply")):
        values = draw(name, chance)
        cases[f"good: {what}"] = (what, reply({kind: values}), echo(kind, plain(name, values)))
    words = "only 12 of 1152 markers were found"
    cases["refused"] = (chance.choice(["status", "describe", "undo"]), reply({"error": words}), "refused")
    cases["another version"] = ("status", encode("Reply", {"version": 2, "status": {}}), "version")
    cases["another answer"] = ("describe", reply({"status": {}}), "malformed")
    cases["no answer in it"] = ("status", reply({}), "malformed")
    cases["not Protobuf"] = ("undo", b"\xff\xff\xff", "malformed")
    return cases
