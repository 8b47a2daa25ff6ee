tractiond simulation, version 1
# A step of a calibration answered an undo whose write was under way; the end of the write answered again.
seed 9
lasts 80000 ms
1000 ms: zero
4000 ms: power-cut
8000 ms: slow-disk 77937 for 60000 ms
9000 ms: undo
60000 ms: noise 8423
