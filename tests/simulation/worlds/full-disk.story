tractiond simulation, version 1
seed 1
lasts 40000 ms
5000 ms: full-disk for 15000 ms
5500 ms: zero
