tractiond simulation, version 1
# The camera was opened anew, and its pictures had another size from the first one on; those of another host, of the agreed size, had no flag.
seed 1
lasts 20000 ms
5000 ms: reopen 0
5010 ms: other-pictures
5011 ms: second-counter 17 for 4000 ms
