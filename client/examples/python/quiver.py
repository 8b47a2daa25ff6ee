"""The next field as arrows, in ten lines. usage: quiver.py [FILE.png]"""
import sys

import matplotlib.pyplot as plt
import traction

with traction.Subscriber(timeout=5) as subscriber:
    newest = {type(message): message for message, _ in zip(subscriber, range(9))}
nodes, field = newest[traction.Description].nodes, newest[traction.Field]
(x, y), (fx, fy, fz) = 1e3 * nodes.positions_m().T, nodes.on_grid(field.force_N).T
longest_N = max(1e-3, (fx**2 + fy**2).max() ** 0.5)  # drawn as long as two pitches; at rest nothing is
plt.quiver(x, y, fx, fy, fz, pivot="mid", angles="xy", scale_units="xy", scale=longest_N / (2e3 * nodes.pitch_m))
plt.colorbar(label="into the gel [N]")
plt.xlabel("x [mm]"), plt.ylabel("y [mm]"), plt.axis("equal"), plt.margins(0.1)
plt.savefig(sys.argv[1]) if len(sys.argv) > 1 else plt.show()
