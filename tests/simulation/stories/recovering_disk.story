tractiond simulation, version 1
# A zero that waited for an earlier write had a minute of its own, as in slow_write_before: here the earlier write is that of the zero in force, on a disk that recovers.
seed 16373444
lasts 106489 ms
14659 ms: failing-disk for 4286 ms
17086 ms: zero
18945 ms: slow-disk 18753 for 90000 ms
39621 ms: zero
