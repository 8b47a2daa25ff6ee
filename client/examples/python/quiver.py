"""The next field as arrows, in ten lines. usage: quiver.py [FILE.png]"""
import sys

import matplotlib.pyplot as plt
import traction

with traction.Subscriber(timeout=5) as subscriber:
    newest = {type(message): message for message, _ in zip(subscriber, range(9))}
nodes, field = newest[traction.Description].nodes, newest[traction.Field]
(x, y), (fx, fy, fz) = 1e3 * nodes.positions_m().T, nodes.on_grid(field.force_N).T
plt.quiver(x, y, fx, fy, fz, pivot="mid")
plt.colorbar(label="into the gel [N]")
plt.xlabel("x [mm]"), plt.ylabel("y [mm]"), plt.axis("equal")
plt.savefig(sys.argv[1]) if len(sys.argv) > 1 else plt.show()
