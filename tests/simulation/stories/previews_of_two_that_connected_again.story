tractiond simulation, version 1
# Two clients of previews left while the publishing thread got no processor. A repeated subscription of one was taken
# for a new one, as the end of the other had been told.
seed 43000131
lasts 33319 ms
3000 ms: previews 192 for 42672 ms
6000 ms: starved 1 for 1546 ms
28318 ms: previews 192 for 7602 ms
29706 ms: starved 3 for 338 ms
