"""What tools/bench --viewer prints: what a browser makes of the fields, in Chromium that has no graphics card."""

import contextlib
import json
import pathlib
import threading
import time

import numpy as np
import zmq

import rig
from browser import Browser, start_view
from figures import TICKS, row


messages = rig.messages
SECONDS = 10

# Counts frames and asks how long the page was at work on each; of its own work the median, of the browser's the mean.
WATCH = """(async () => {
  const model = traction.model, works = [];
  let frames = 0, drawn = model.drawn, surfaces = 0, surface = null, isOver = false;
  const look = () => {
    ++frames;
    if (model.drawn !== drawn) works.push(model.last_work_ms);
    if (model.surface !== surface) ++surfaces;
    drawn = model.drawn;
    surface = model.surface;
    if (!isOver) requestAnimationFrame(look);
  };
  const first = model.drawn, came = model.fields, begin = performance.now();
  look();
  await new Promise((done) => setTimeout(done, %d));
  isOver = true;
  const seconds = (performance.now() - begin) / 1e3;
  works.sort((a, b) => a - b);
  return {drawn: (model.drawn - first) / seconds, came: (model.fields - came) / seconds, frames: frames / seconds,
          surfaces: surfaces / seconds,
          work_ms: works[works.length >> 1], late_ms: works[Math.floor(works.length * 0.99)]};
})()""" % (1000 * SECONDS)


class Crowd:
    """Publishes fields of so many nodes, with three touches that wander, 60 in a second."""

    def __init__(self, bench, columns, description):
        self.description = description
        self.description.nodes.columns = self.description.nodes.rows = columns
        self.description.nodes.pitch_m *= 23 / (columns - 1)
        self.columns = columns
        self.socket = zmq.Context.instance().socket(zmq.XPUB)
        self.endpoint = f"ipc://{bench.folder / 'crowd'}"
        self.socket.bind(self.endpoint)
        bench.callback(self.end)
        self.isOver = threading.Event()
        self.thread = threading.Thread(target=self.publish)
        self.thread.start()

    def end(self):
        self.isOver.set()
        self.thread.join()
        self.socket.close(0)

    def fields(self):
        """A lap of them, made beforehand: what publishes takes no time from who draws."""
        place = np.stack(np.meshgrid(np.linspace(-1, 1, self.columns), np.linspace(-1, 1, self.columns)), axis=-1)
        for phase in np.linspace(0, 2 * np.pi, 60, endpoint=False):
            force = np.zeros((self.columns, self.columns, 3))
            for number, size in enumerate((0.15, 0.25, 0.35)):
                centre = 0.5 * np.array([np.cos(phase + 2 * number), np.sin(phase + 2 * number)])
                off = place - centre
                weight = np.exp(-0.5 * (off**2).sum(-1) / size**2)
                force += weight[..., None] * np.stack([-off[..., 1], off[..., 0], np.full(weight.shape, 0.5)], axis=-1)
            field = messages.Field()
            field.header.sensor = self.description.header.sensor
            field.header.boot = self.description.header.boot
            field.valid = True
            field.force_N.extend((4 * force / force[..., 2].sum()).ravel().astype(np.float32))
            field.node_valid = bytes([1]) * self.columns**2
            total = 4 * force.sum((0, 1)) / force[..., 2].sum()
            field.resultant_N.x, field.resultant_N.y, field.resultant_N.z = total
            yield field

    def publish(self):
        lap = list(self.fields())
        number = 0
        due = time.monotonic()
        while not self.isOver.wait(max(0.0, due - time.monotonic())):
            due = max(due + 1 / 60, time.monotonic())
            number += 1
            if number % 60 == 1:
                self.send("description", self.description, number)
            field = lap[number % len(lap)]
            field.header.frame_number = number
            self.send("field", field, number)

    def send(self, kind, message, number):
        message.header.sequence = number
        message.header.received_real_ns = time.time_ns()
        self.socket.send_multipart([f"traction/v1/{message.header.sensor}/{kind}/".encode(), message.SerializeToString()])


def processor_s():
    """Of all of Chromium's processes."""
    ticks = 0
    for stat in pathlib.Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            name, words = stat.read_text().split("(", 1)[1].rsplit(")", 1)
            if name == "chromium":
                ticks += sum(map(int, words.split()[11:13]))
    return ticks / TICKS


def rates(browser, name, least):
    spent = processor_s()
    seen = browser.evaluate(WATCH)
    spent = (processor_s() - spent) / (SECONDS * seen["drawn"])
    before = browser.ask(metrics=True)
    drawn = browser.evaluate("traction.model.drawn")
    time.sleep(3)
    after = browser.ask(metrics=True)
    drawn = browser.evaluate("traction.model.drawn") - drawn
    row(f"{name}: drawn, of {seen['came']:.0f} that come", f"{seen['drawn']:.1f} frames/s", f">= {least}", seen["drawn"])
    if seen["surfaces"] > 1:
        row("    views a and d, which take turns", f"{seen['surfaces']:.1f} frames/s")
    row("    the page's own work for a frame, median", f"{seen['work_ms']:.1f} ms", "<= 4 ms", seen["work_ms"])
    row("    99 % of them", f"{seen['late_ms']:.1f} ms")
    whole = [1e3 * (after[key] - before[key]) / max(drawn, 1) for key in ("ScriptDuration", "LayoutDuration", "RecalcStyleDuration")]
    row("    with messages, texts and plot, by Chromium: script, layout, style",
        f"{whole[0]:.1f}, {whole[1]:.1f}, {whole[2]:.1f} ms")
    row("    processor time of all of Chromium for a frame", f"{1e3 * spent:.1f} ms")


def delays(browser, twin, bench):
    """Camera frame to picture: the twin says when it had the frame, Chromium's trace when what was drawn of it was shown."""
    browser.evaluate("""(() => {
      let before = null;
      const look = () => {
        const {drawn_sequence, field} = traction.model;
        if (drawn_sequence !== before && drawn_sequence === field.header.sequence) performance.mark(`frame ${field.header.camera_frame_id}`);
        before = drawn_sequence;
        requestAnimationFrame(look);
      };
      requestAnimationFrame(look);
    })()""")
    file = bench.folder / "trace.json"
    browser.ask(trace=[str(file), 1000 * SECONDS, "benchmark,blink.user_timing"])
    truth = rig.read_truth(twin)
    tracks = {}
    marks = []
    for event in sorted(json.loads(file.read_text()), key=lambda event: event.get("ts", 0)):
        if event["name"].startswith("frame ") and event["cat"] == "blink.user_timing":
            marks.append((event["ts"], truth.get(int(event["name"].split()[1]))))
        if event["ph"] in "be" and "id2" in event:
            tracks.setdefault((event["pid"], event["id2"].get("local")), []).append(event)
    frames = []  # when the page's turn began, when it was over, when what came of it was shown
    for track in tracks.values():
        begin = end = None
        for event in track:
            what = event["name"], event["ph"]
            if what == ("PipelineReporter", "b"):
                begin = end = None
            elif what == ("SendBeginMainFrameToCommit", "b"):
                begin = event["ts"]
            elif what == ("SendBeginMainFrameToCommit", "e"):
                end = event["ts"]
            elif what == ("SwapEndToPresentationCompositorFrame", "e") and begin and end:
                frames.append((begin, end, event["ts"]))
    late = sorted(shown / 1e3 - seen["monotonic_ns"] / 1e6 for mark, seen in marks if seen
                  for begin, end, shown in frames if begin <= mark <= end)
    if not late:
        return row("camera frame -> pixel changed in the page", "never")
    p50, p99 = late[len(late) // 2], late[len(late) * 99 // 100]
    row(f"camera frame -> pixel changed in the page, {len(late)} frames, p50", f"{p50:.1f} ms", "<= 30 ms", p50)
    row("                                                        p99", f"{p99:.1f} ms", "<= 60 ms", p99)


def main():
    with rig.Rig() as bench:
        twin = bench.twin("hold")
        daemon = bench.daemon()
        view = start_view(bench, daemon)
        browser = Browser(bench, view.url)
        browser.wait_for("window.traction?.model?.surface_share === 1 && traction.model.field?.resultant_N[2] > 3", 120)
        browser.ask(ignoreRequests=True)
        rates(browser, "24 x 24 nodes, four views", 30)
        delays(browser, twin, bench)
        description = bench.subscribe(daemon, "traction/v1/").collect(1, kind="description")[0]
        browser.end()
        for process in (view, daemon, twin):
            process.stop()
        view = start_view(bench, None, "--connect", Crowd(bench, 100, description).endpoint)
        browser = Browser(bench, view.url)
        browser.wait_for("window.traction?.model?.vectors", 120)
        rates(browser, "100 x 100 nodes, b to d (of so many a is not computed)", 15)


if __name__ == "__main__":
    main()
