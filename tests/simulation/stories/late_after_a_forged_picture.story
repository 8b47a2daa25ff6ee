tractiond simulation, version 1
# The camera's next picture came late, and the time until then excused its own picture that came after the forged one.
seed 128
lasts 4000 ms
2990 ms: late 30 for 100 ms
3000 ms: impostor 1000 for 10 ms
