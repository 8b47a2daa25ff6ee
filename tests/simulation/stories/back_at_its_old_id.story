tractiond simulation, version 1
# The counter began anew beside another host's pictures: neither was used until it came back to where it had been, and then no gap was told.
seed 5358
lasts 9792 ms
4371 ms: second-counter 18 for 5685 ms
4397 ms: ids-restart
