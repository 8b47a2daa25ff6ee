tractiond simulation, version 1
seed 1
lasts 20000 ms
5000 ms: gone for 9000 ms
