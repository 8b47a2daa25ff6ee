tractiond simulation, version 1
# A zero waited for an earlier write, and then had a minute of its own: its answer came later than the status promised.
seed 5049
lasts 400000 ms
248571 ms: full-disk for 51661 ms
254339 ms: zero-anyway
296655 ms: slow-disk 51491 for 8872 ms
324400 ms: zero
335787 ms: slow-disk 17695 for 77160 ms
