tractiond simulation, version 1
# The daemon was ending, as another client held its first camera; a subscriber that changed its mind then stopped the simulation's time.
seed 2359569182
lasts 572000 ms
151824 ms: starved 3 for 1821 ms
202649 ms: other-pictures
271330 ms: starved 4 for 1988 ms
337451 ms: silence for 4182 ms
350857 ms: starved 3 for 1982 ms
454269 ms: gone for 19827 ms
556648 ms: previews 121 for 18280 ms
560383 ms: starved 0 for 1214 ms
560576 ms: held for 14730 ms
