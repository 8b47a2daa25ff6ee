tractiond simulation, version 1
seed 1
lasts 20000 ms
5000 ms: silence for 4000 ms
