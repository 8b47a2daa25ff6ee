tractiond simulation, version 1
seed 1
lasts 12000 ms
5000 ms: second-counter 20 for 4000 ms
