tractiond simulation, version 1
seed 1
lasts 10000 ms
5000 ms: broken 100 for 100 ms
