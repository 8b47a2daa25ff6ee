"""The Python client against publishers that come, go, lose, lock and lie. What it reads right: tests/conformance."""

import asyncio
import os
import pathlib
import socket
import stat
import sys
import tempfile
import time
import unittest
from unittest import mock

import seed
import zmq

SOURCE = pathlib.Path(__file__).resolve().parents[3]
CLIENT = SOURCE / "client" / "python"
sys.path.insert(0, str(CLIENT))
import traction  # noqa: E402
from deadline import HUNG_S  # noqa: E402
from publisher import Publisher  # noqa: E402
from traction.endpoints import TCP, locate  # noqa: E402
from traction.v1 import messages  # noqa: E402


def field(sequence, boot=bytes(range(16)), nodes=0):
    """As it is sent."""
    message = messages.Field(timestamp=1.0, valid=True, force_N=[0.0] * (3 * nodes), node_valid=bytes(nodes))
    message.header.sequence, message.header.boot, message.header.sensor = sequence, boot, "gel"
    return [b"traction/v1/gel/field/", message.SerializeToString(), b"1.0"]


class Case(unittest.TestCase):
    def setUp(self):
        self.context = zmq.Context()
        self.addCleanup(self.context.destroy, 0)

    def bind(self, kind=zmq.XPUB, endpoint="tcp://127.0.0.1:*", **options):
        one = self.context.socket(kind)
        self.addCleanup(one.close, 0)
        one.linger = 0
        for name, value in options.items():
            setattr(one, name, value)
        end = time.monotonic() + HUNG_S
        while True:
            try:
                one.bind(endpoint)
                return one, one.getsockopt_string(zmq.LAST_ENDPOINT)
            except zmq.ZMQError as error:  # who had it before is not gone yet
                if error.errno != zmq.EADDRINUSE or time.monotonic() > end:
                    raise
                time.sleep(0.01)

    def subscriber(self, endpoint, **options):
        return self.enterContext(traction.Subscriber(endpoint=endpoint, **options))

    def until(self, condition, subscriber):
        end = time.monotonic() + HUNG_S
        while not condition():
            self.assertLess(time.monotonic(), end)
            subscriber.receive(0.01)


class Field(unittest.TestCase):
    def test_it_states_the_shear_of_each_node_over_its_normal_force(self):
        def told(deviation):
            message = messages.Field(valid=True, force_N=[0.03, 0.04, 0.1, 0.03, 0.04, 0.01], node_valid=b"\1\1", node_deviation_N=deviation)
            return traction.decode.decode("field", message.SerializeToString()).shear_ratio()

        ratio, deviation = told(2 * [0.01, 0.01, 0.02])
        self.assertAlmostEqual(ratio[0], 0.5, 6)
        self.assertAlmostEqual(deviation[0], 0.02 ** 0.5 * 1.0, 6)
        for numbers in (ratio[1:], deviation[1:], *told([])):
            self.assertTrue(all(number != number for number in numbers))


class Subscriber(Case):
    def test_it_connects_again_and_a_new_start_is_told_and_is_no_loss(self):
        draw = seed.chance(self.id())
        publisher, endpoint = self.bind()
        subscriber = self.subscriber(endpoint)
        for start in range(3):
            self.until(lambda: publisher.poll(0), subscriber)  # receive() is what connects again, where ZeroMQ has given up
            publisher.recv()
            boot, begin = draw.randbytes(16), draw.choice([1, 1000])
            for sequence in range(begin, begin + 3):
                publisher.send_multipart(field(sequence, boot))
                self.assertEqual(subscriber.receive(HUNG_S).header.boot, boot)
            self.assertEqual((subscriber.restarts, subscriber.lost), (start, 0))
            self.assertTrue(subscriber.is_connected)
            publisher.close()
            self.until(lambda: not subscriber.is_connected, subscriber)
            publisher, _ = self.bind(endpoint=endpoint)

    def test_latest_is_the_newest_and_many_parts_are_malformed(self):
        publisher, endpoint = self.bind(sndhwm=0)
        subscriber = self.subscriber(endpoint, mode=traction.Mode.LATEST)
        self.assertTrue(publisher.poll(1000 * HUNG_S))
        publisher.recv()
        publisher.send_multipart([field(1)[1]] * 300)
        self.assertRaises(traction.Malformed, subscriber.receive, HUNG_S)
        sent = 1
        for waiting in (1, 2, 499, 1000, 5000):  # the last are more than the queue holds
            received = 0
            for sent in range(sent + 1, sent + 1 + waiting):
                publisher.send(field(sent)[1])
            while received != sent:
                received, before = subscriber.receive(HUNG_S).header.sequence, received
                self.assertGreater(received, before)
            self.assertIsNone(subscriber.receive(0))
        self.assertEqual(subscriber.lost, 0)

    def test_silence_ends_an_iteration_with_a_sentence(self):
        _, endpoint = self.bind()
        with self.assertRaisesRegex(traction.NoAnswer, f"nothing came from {endpoint} within 0.05 s"):
            next(traction.fields(endpoint=endpoint, timeout=0.05))
        self.assertIsNone(self.subscriber(endpoint).receive(0))

    def test_subscription_that_the_publisher_lost_is_sent_again_until_a_message_arrives(self):
        for mode, subscription, parts in ((traction.Mode.LATEST, b"\x09", field(1)[1:2]),
                                          (traction.Mode.STREAM, b"", field(1))):
            # A subscription has no effect until this test accepts it.
            publisher, endpoint = self.bind(xpub_manual=True)
            subscriber = self.subscriber(endpoint, mode=mode)
            for _ in range(2):
                self.until(lambda: publisher.poll(0), subscriber)
                self.assertEqual(publisher.recv(), b"\x01" + subscription)
            publisher.setsockopt(zmq.SUBSCRIBE, subscription)
            publisher.send_multipart(parts)
            self.assertEqual(subscriber.receive(HUNG_S).header.sequence, 1)

    def test_bad_endpoints_and_names_are_refused(self):
        for endpoint in ("nonsense", "tcp://", "http://localhost"):
            with self.assertRaisesRegex(traction.BadEndpoint, "an endpoint is written tcp://HOST:PORT"):
                traction.Subscriber(endpoint=endpoint)
        for name in ("../etc", "", "a" * 25, "é"):
            with self.assertRaisesRegex(traction.BadEndpoint, "not an instance's name"):
                traction.Subscriber(name)

    def test_an_instance_is_found_where_its_sockets_are(self):
        folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="traction-")))
        self.enterContext(mock.patch.dict(os.environ, XDG_RUNTIME_DIR=str(folder)))
        at = folder / "tractiond" / "left"
        self.assertEqual([one.latest for one in locate("left")], [f"ipc://{at}/latest", "ipc:///run/tractiond/left/latest"])
        if not pathlib.Path("/run/tractiond/default").exists():
            self.assertEqual(locate(), [TCP])
        control = traction.Control("left")  # before its daemon starts
        at.mkdir(parents=True)
        publisher, _ = self.bind(endpoint=f"ipc://{at}/stream")
        self.assertEqual(control.endpoint, f"ipc://{at}/control")
        self.assertEqual([one.control for one in locate("left")], [f"ipc://{at}/control"])
        subscriber = self.enterContext(traction.Subscriber("left"))
        self.assertTrue(publisher.poll(1000 * HUNG_S))
        publisher.send_multipart(field(7))
        self.assertEqual(subscriber.receive(HUNG_S).header.sequence, 7)

    def test_sockets_in_a_directory_that_another_user_controls_are_refused(self):
        folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="traction-")), "open")
        self.enterContext(mock.patch.dict(os.environ, XDG_RUNTIME_DIR=str(folder)))
        folder.mkdir()
        folder.chmod(0o1777)
        locate("left")
        own = folder / "tractiond"
        self.assertEqual(stat.S_IMODE(own.stat().st_mode), 0o700, "no other user can make it later")
        for instance in ("left", "default"):
            (own / instance).mkdir()
            self.bind(endpoint=f"ipc://{own / instance}/stream")
            self.assertEqual([one.stream for one in locate(instance)], [f"ipc://{own / instance}/stream"])
        own.chmod(0o777)
        for instance in ("left", "default", "right"):
            with self.assertRaisesRegex(traction.BadEndpoint, f"{own / instance} cannot be used: another user may control it"):
                traction.Subscriber(instance)
        own.chmod(0o755)
        locate("right")
        if os.geteuid() == 0:  # who can give directories away
            os.chown(own, 65534, 65534)
            for instance in ("left", "default", "right"):
                self.assertRaises(traction.BadEndpoint, traction.Control, instance)


class Asyncio(Case):
    def test_fields_come_to_several_and_cancelling_loses_none(self):
        draw = seed.chance(self.id())
        publisher, endpoint = self.bind(xpub_verbose=True)  # tells of each subscriber

        async def read(count):
            seen = []
            async with traction.aio.Subscriber(endpoint=endpoint) as subscriber:
                while len(seen) < count:
                    try:
                        seen.append((await asyncio.wait_for(subscriber.receive(), 0.003)).header.sequence)
                    except TimeoutError:
                        pass
                self.assertEqual(subscriber.lost, 0)
            return seen

        async def publish():
            for _ in range(2):
                while not publisher.poll(0):
                    await asyncio.sleep(0.001)
                publisher.recv()
            await asyncio.sleep(0.1)
            for sequence in range(1, 101):
                publisher.send_multipart(field(sequence))
                await asyncio.sleep(draw.choice([0, 0, 0.005]))

        async def both():
            return await asyncio.wait_for(asyncio.gather(read(100), read(100), publish()), HUNG_S)

        one, other, _ = asyncio.run(both())
        self.assertEqual(one, [*range(1, 101)])
        self.assertEqual(other, one)

    def test_generator_and_silence(self):
        publisher = Publisher(lambda request: messages.Reply(version=1, status=messages.Status(uptime_s=2.5)))
        self.addCleanup(publisher.close)

        async def first(endpoint, timeout):
            async for one in traction.aio.fields(endpoint=endpoint, timeout=timeout):
                return one.resultant_N.tolist()

        self.assertEqual(asyncio.run(first(publisher.endpoint(publisher.stream), HUNG_S)), [1.5, -2.5, 3.5])
        _, silent = self.bind()
        with self.assertRaises(traction.NoAnswer):
            asyncio.run(first(silent, 0.05))
        endpoint = publisher.endpoint(publisher.control)

        async def uptime_s():
            with traction.Control(endpoint=endpoint, timeout=HUNG_S) as control:
                async with traction.aio.Control(control) as one:
                    return (await one.status()).uptime_s

        self.assertEqual(asyncio.run(uptime_s()), 2.5)


class Control(Case):
    def test_who_is_not_there_or_takes_no_requests_is_told(self):
        with socket.socket() as nobody:
            nobody.bind(("127.0.0.1", 0))  # and does not listen
            endpoint = f"tcp://127.0.0.1:{nobody.getsockname()[1]}"
            with self.assertRaisesRegex(traction.NoAnswer, f"nothing answers at {endpoint}; is tractiond running"):
                traction.Control(endpoint=endpoint, timeout=0.2).status()
        with self.assertRaisesRegex(traction.NoAnswer, "nothing answers at ipc:///nowhere"):
            traction.Control(endpoint="ipc:///nowhere").status()
        _, stream = self.bind()
        with self.assertRaisesRegex(traction.NoAnswer, "takes no requests; is it the endpoint 'control'"):
            traction.Control(endpoint=stream).status()
        _, silent = self.bind(zmq.REP)
        with self.assertRaisesRegex(traction.NoAnswer, "somebody is at .*, but has not answered within 3 s"):
            traction.Control(endpoint=silent).status()


class Keys(Case):
    def setUp(self):
        super().setUp()
        self.server, self.server_secret = zmq.curve_keypair()
        self.own = zmq.curve_keypair()

    def gateway(self):
        return self.bind(curve_server=True, curve_publickey=self.server, curve_secretkey=self.server_secret)

    def keys(self, server=None):
        return traction.Keys((server or self.server).decode(), self.own[0].decode(), self.own[1].decode())

    def refused(self, endpoint, pattern, **options):
        subscriber = self.subscriber(endpoint, **options)
        end = time.monotonic() + HUNG_S
        with self.assertRaisesRegex(traction.NotAllowed, pattern):
            while time.monotonic() < end:
                subscriber.receive(0.1)

    def test_with_keys_fields_come_and_without_the_reason(self):
        publisher, endpoint = self.gateway()
        subscriber = self.subscriber(endpoint, keys=self.keys())
        self.assertTrue(publisher.poll(1000 * HUNG_S))
        publisher.send_multipart(field(1))
        self.assertEqual(subscriber.receive(HUNG_S).header.sequence, 1)
        self.refused(endpoint, "asks for a key, and none is given")
        self.refused(endpoint, "ends each connection: the server key is not this", keys=self.keys(zmq.curve_keypair()[0]))
        # It depends on who ends the connection first.
        self.refused(self.bind()[1], "knows no keys; is it a gateway|ends each connection", keys=self.keys())

    def test_files_of_keys(self):
        path = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory(prefix="traction-")), "key")
        public, secret = (key.decode() for key in self.own)

        def load(text, mode=0o600):
            path.write_text(text)
            path.chmod(mode)
            return traction.load_keys(path)

        pair = f'public = "{public}"\nsecret = "{secret}"\n'
        self.assertEqual(load(f'{pair}server = "{self.server.decode()}"\n'), self.keys())
        self.assertEqual(load(pair), traction.Keys("", public, secret))
        for text, mode, why in ((pair, 0o604, "others can read"), ("public = 1", 0o600, "public is not a key"),
                                (pair + "x = 1\n", 0o600, "'x' is not one of"), ("=", 0o600, ""),
                                (pair.replace(public, self.server.decode()), 0o600, "does not belong to the secret one")):
            with self.assertRaisesRegex(traction.BadKeys, f"{path}: .*{why}") as caught:
                load(text, mode)
            self.assertNotIn(secret, str(caught.exception))
        with self.assertRaises(traction.BadKeys):
            traction.load_keys(path / "absent")
        with self.assertRaisesRegex(traction.BadKeys, "the server key '' is not a key"):
            traction.Subscriber(endpoint="tcp://127.0.0.1:1", keys=traction.Keys("", public, secret))
