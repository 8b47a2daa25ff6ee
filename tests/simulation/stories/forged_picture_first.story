tractiond simulation, version 1
# At the start another host's picture came first: the camera's counter replaced it without a flag, as no time between frames was known.
seed 42
lasts 4500 ms
1000 ms: late 47 for 2980 ms
1290 ms: second-counter 44 for 9397 ms
1440 ms: power-cut
