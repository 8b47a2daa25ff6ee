tractiond simulation, version 1
# The same, where no clock of the camera tells that no picture is missing.
seed 101
lasts 4000 ms
2800 ms: no-clock for 50 ms
2990 ms: late 30 for 100 ms
3000 ms: impostor 1000 for 10 ms
