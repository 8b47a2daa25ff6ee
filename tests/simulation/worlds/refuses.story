tractiond simulation, version 1
seed 1
lasts 12000 ms
5000 ms: reopen 1
