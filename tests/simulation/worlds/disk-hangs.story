tractiond simulation, version 1
seed 1
lasts 90000 ms
5000 ms: slow-disk 70000 for 1000 ms
5500 ms: zero
