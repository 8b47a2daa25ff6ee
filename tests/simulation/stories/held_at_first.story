tractiond simulation, version 1
# Another client held the first camera for longer than the daemon tries: the daemon ended, which the simulation took for a stage that stands still.
seed 7022
lasts 40000 ms
12626 ms: slow-answers 1467 for 9499 ms
12706 ms: power-cut
21407 ms: held for 9598 ms
