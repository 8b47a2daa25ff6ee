tractiond simulation, version 1
seed 1
lasts 25000 ms
5000 ms: touch 4000 for 8000 ms
7000 ms: zero
16000 ms: zero
18000 ms: undo
