tractiond simulation, version 1
seed 1
lasts 30000 ms
5000 ms: gone for 3000 ms
5000 ms: held for 15000 ms
