"""Pictures for a daemon whose pace nobody prescribes: a scene is shown, over and over, until the next one."""

import itertools
import os
import select
import subprocess
import threading

import rig


def scenes(bench, scenario, spans, *options):
    """Returns pictures of a scenario at 60 frames/s, of 640 x 480 RGB8: a list for each (first, last) in seconds, in order."""
    end_s = spans[-1][1]
    twin = subprocess.Popen(
        [str(word) for word in (rig.BIN / "traction-twin", scenario, "--cache", rig.cache_directory(), "--images", "-",
                                "--rate", 60, "--seconds", end_s, *options)], stdout=subprocess.PIPE,
        stdin=subprocess.DEVNULL, start_new_session=True)
    bench.callback(twin.wait)
    bench.callback(twin.kill)
    result = [[] for _ in spans]
    for number in range(round(60 * end_s)):
        picture = twin.stdout.read(640 * 480 * 3)
        assert len(picture) == 640 * 480 * 3, f"the twin ended after {number} pictures"
        for scene, (first_s, last_s) in zip(result, spans):
            if 60 * first_s <= number < 60 * last_s:
                scene.append(picture)
    twin.stdout.close()
    return result


class Projector:
    """A pipe with a writer's thread: a daemon takes as many pictures as it solves, and none is lost."""

    PAUSE_S = 0.01  # after each picture: other tests want the processor, too
    CONFIG = '[camera]\nwidth_px = 640\nheight_px = 480\npixel_format = "RGB8"\n'

    def __init__(self, bench, scene):
        self.pipe = bench.folder / f"scene-{id(self)}"
        os.mkfifo(self.pipe)
        self.ours = os.open(self.pipe, os.O_RDWR | os.O_NONBLOCK)  # a daemon that ends breaks nothing
        self.ended = threading.Event()
        self.show(scene)
        self.thread = threading.Thread(target=self._write, daemon=True)
        self.thread.start()
        bench.callback(self.stop)

    def show(self, scene):
        """From the next picture on."""
        self.scene = itertools.cycle(scene)

    def stop(self):
        self.ended.set()
        self.thread.join()

    def _write(self):
        while not self.ended.is_set():
            picture = memoryview(next(self.scene))
            while picture and not self.ended.is_set():
                if select.select([], [self.ours], [], 0.1)[1]:
                    picture = picture[os.write(self.ours, picture):]
            self.ended.wait(self.PAUSE_S)
        os.close(self.ours)
