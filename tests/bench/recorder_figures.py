"""What tools/bench --record prints: what a recording of every picture costs the daemon, beside the same time without."""

import re
import sys

import numpy as np

from figures import latency_ms, live, row


def main():
    seconds = 10 if "--quick" in sys.argv[1:] else 60
    without, cost = [], []
    fields, _, _, cpu, _ = live("press", seconds / 2)
    without += fields
    cost.append(cpu)
    recorded, _, daemon, cpu_recording, memory = live("press", seconds, record=True)
    fields, _, _, cpu, _ = live("press", seconds / 2)
    without += fields
    cost.append(cpu)

    account = re.search(r"recorded: (\d+) pictures and (\d+) fields in .*, ([\d.]+) MB(?:; (\d+) pictures and (\d+))?",
                        daemon.output())
    pictures, _, size_MB, *missing = account.groups()
    lost = sum(int(number or 0) for number in missing)
    row(f"{pictures} pictures of 640 x 480 RGB8 at 60 frames/s, {float(size_MB) / 1e3:.1f} GB: dropped", str(lost), "0", lost)
    more = cpu_recording - np.mean(cost)
    row("processor time of the recorder", f"{100 * more:.1f} % of a core", "<= 25 %", more)
    row("    of the daemon, with and without it", f"{100 * cpu_recording:.1f}, {100 * np.mean(cost):.1f} %")
    for name, with_it, alone in zip(("p50", "p99"), latency_ms(recorded), latency_ms(without)):
        row(f"frame popped -> message received, {name}, with and without it", f"{with_it:.3f}, {alone:.3f} ms",
            "<= 1.2 x", with_it / alone)
    row("peak resident memory of the daemon", f"{memory[1]:.0f} MB")


if __name__ == "__main__":
    main()
