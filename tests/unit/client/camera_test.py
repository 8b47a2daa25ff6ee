"""tractionctl camera and trigger, against a daemon's camera of a few features."""

import json

import seed
from ctl import TEMPORARY, UNAVAILABLE, USAGE, Case, ctl
from traction.v1 import messages


class Camera:
    """What a daemon makes of requests about its camera."""

    def __init__(self):
        self.asked = []
        self.features = {}
        self.add("ExposureTime", "4000", "us", "FLOAT", "READ_WRITE", 10, 1e6, category="AcquisitionControl",
                 configured="5000", description="of a picture")
        self.add("Gain", "0.0", "dB", "FLOAT", "READ_WRITE", 0, 24, category="AnalogControl", configured="0")
        self.add("BlackLevel", "3", "", "INTEGER", "READ_WRITE", 0, 255, 1, category="AnalogControl", first="7")
        self.add("GainAuto", "Off", "", "ENUMERATION", "READ_WRITE", entries=["Off", "Once", "Continuous"],
                 category="AnalogControl")
        self.add("ReverseX", "false", "", "BOOLEAN", "READ", category="ImageFormatControl")
        self.add("DeviceUserID", "\x1b[2J\x9b2Jleft", "", "STRING", "READ_WRITE", category="DeviceControl")
        self.add("DeviceTemperature", "41.5", "C", "FLOAT", "READ", category="DeviceControl")
        self.add("UserSetLoad", "", "", "COMMAND", "WRITE", category="UserSetControl")
        self.add("TimestampLatchValue", str(2**63 - 1), "ns", "INTEGER", "READ", category="DeviceControl")

    def add(self, name, value, unit, kind, access, minimum=None, maximum=None, increment=None, **more):
        feature = messages.CameraFeature(name=name, value=value, unit=unit, minimum=minimum, maximum=maximum,
                                         increment=increment, **more)
        feature.kind = messages.CameraFeatureKind.Value("CAMERA_FEATURE_KIND_" + kind)
        feature.access = messages.CameraFeatureAccess.Value("CAMERA_FEATURE_ACCESS_" + access)
        self.features[name] = feature

    def answer(self, request):
        reply = messages.Reply(version=1)
        reply.camera.camera = "Acme-42"
        step = request.camera.WhichOneof("step")
        asked = getattr(request.camera, step)
        self.asked.append((step, getattr(asked, "name", ""), getattr(asked, "value", "")))
        if step == "list":
            reply.camera.features.extend(
                feature for feature in self.features.values() if asked.matching.lower() in feature.name.lower() and
                (not asked.categories or feature.category in asked.categories))
        elif step in ("read", "write", "execute") and asked.name not in self.features:
            return messages.Reply(version=1, error=f"the camera has no feature {asked.name}")
        elif step == "write":
            feature = self.features[asked.name]
            feature.first = feature.first or feature.value
            feature.value = asked.value
            reply.camera.features.append(feature)
        elif step == "read":
            reply.camera.features.append(self.features[asked.name])
        elif step == "balance_white":
            reply.camera.features.append(messages.CameraFeature(name="BalanceRatio", value="1.25", kind=2, access=3,
                                                                selected=["BalanceRatioSelector=Red"]))
            reply.camera.features.append(messages.CameraFeature(name="BalanceRatio", value="2", kind=2, access=3,
                                                                selected=["BalanceRatioSelector=Blue"]))
            reply.camera.remarks.append("the picture is dark")
        return reply


class CameraCommand(Case):
    def setUp(self):
        self.camera = Camera()
        self.endpoints = self.publisher(self.camera.answer)

    def run_ok(self, *words):
        code, out, err = ctl(*words, *self.endpoints)
        self.assertEqual((code, err), (0, ""), out)
        return out

    def test_list_chooses_by_name_and_category(self):
        for words, expected in ((["gain"], ["Gain", "GainAuto"]),
                                (["--category", "AnalogControl"], ["Gain", "BlackLevel", "GainAuto"]),
                                (["auto", "--category", "AnalogControl", "--category", "DeviceControl"], ["GainAuto"])):
            found = json.loads(self.run_ok("camera", "list", *words, "--json"))["features"]
            self.assertEqual([feature["name"] for feature in found], expected)
        self.assertEqual(self.run_ok("camera", "list", "nothing"), "no feature of the camera matches\n")

    def test_json_has_numbers_by_kind(self):
        found = json.loads(self.run_ok("camera", "list", "--json"))
        self.assertEqual((found["camera"], found["remarks"]), ("Acme-42", []))
        values = {feature["name"]: feature["value"] for feature in found["features"]}
        self.assertEqual(values, {"ExposureTime": 4000.0, "Gain": 0.0, "BlackLevel": 3, "GainAuto": "Off",
                                  "ReverseX": False, "DeviceUserID": "\x1b[2J\x9b2Jleft", "DeviceTemperature": 41.5,
                                  "UserSetLoad": None, "TimestampLatchValue": 2**63 - 1})
        exposure = found["features"][0]
        self.assertEqual((exposure["configured"], exposure["first"], exposure["maximum"], exposure["increment"]),
                         (5000, None, 1e6, None))
        self.assertEqual((exposure["kind"], exposure["access"], exposure["unit"]), ("float", "read-write", "us"))

    def test_alone_shows_what_is_configured_or_changed_and_the_temperature(self):
        out = self.run_ok("camera")
        self.assertRegex(out, r"\AAcme-42: 9 features")
        for name in ("ExposureTime", "Gain ", "BlackLevel", "DeviceTemperature"):
            self.assertIn(name, out)
        for name in ("GainAuto", "UserSetLoad", "DeviceUserID"):
            self.assertNotIn(name, out)

    def test_set_writes_in_order_and_shows_what_the_camera_made_of_it(self):
        draw = seed.chance(self.id())
        names = draw.sample(["ExposureTime", "Gain", "BlackLevel", "DeviceUserID"], 3)
        changes = [(name, draw.choice(["7", "a = b", "", "-1.5"])) for name in names]
        found = json.loads(self.run_ok("camera", "set", *(f"{name}={value}" for name, value in changes), "--json"))
        self.assertEqual(self.camera.asked, [("write", name, value) for name, value in changes])
        self.assertEqual([feature["name"] for feature in found["features"]], names)

    def test_what_was_done_before_a_failure_is_shown(self):
        code, out, err = ctl("camera", "set", "Gain=3", "Gian=4", "BlackLevel=5", *self.endpoints)
        self.assertEqual(code, TEMPORARY)
        self.assertIn("Gain = 3 dB", out)
        self.assertEqual(err, "tractionctl: Gian: the camera has no feature Gian; what stands before it was done\n")
        self.assertEqual(len(self.camera.asked), 2)
        self.fails(TEMPORARY, "the camera has no feature Gian", "camera", "get", "Gian", *self.endpoints)

    def test_run_white_temperature_trigger(self):
        self.assertEqual(self.run_ok("camera", "run", "UserSetLoad"), "done\n")
        out = self.run_ok("camera", "white")
        self.assertIn("BalanceRatio [BalanceRatioSelector=Red]   1.25", out)
        self.assertIn("note: the picture is dark", out)
        self.assertIn("DeviceTemperature = 41.5 C", self.run_ok("camera", "temperature"))
        self.assertEqual(self.run_ok("trigger"), "")
        self.assertEqual([step for step, *_ in self.camera.asked], ["execute", "balance_white", "list", "trigger"])

    def test_wrong_words(self):
        for words in (["Gain"], ["=5"], ["BlackLevel=5", "Gain", "3"], [""]):
            wrong = next(word for word in words if word.find("=") < 1)
            self.fails(USAGE, f"'{wrong}' is not NAME=VALUE, for example: ExposureTime=4000", "camera", "set", *words, *self.endpoints)
        self.fails(USAGE, "nonsense", "camera", "nonsense")
        for command in ("get", "set", "run"):
            self.fails(USAGE, "is required", "camera", command)
        self.fails(UNAVAILABLE, r"is tractiond running\?", "camera", "list", "--instance", "absent")
        self.assertEqual(self.camera.asked, [])
