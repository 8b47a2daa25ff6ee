tractiond simulation, version 1
# Killed between the rename and the synchronisation of the directory: the next daemon restored a zero that a loss of power took back.
seed 2
lasts 60000 ms
5000 ms: slow-disk 4206 for 50000 ms
5300 ms: zero
19500 ms: kill
40000 ms: power-cut
