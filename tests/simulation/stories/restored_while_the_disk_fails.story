tractiond simulation, version 1
# Killed while the disk failed, and started while it still did: the zero that was restored was not written when the disk was well again.
seed 3575199789
lasts 425865 ms
309521 ms: slow-disk 5255 for 84817 ms
343393 ms: zero
357656 ms: failing-disk for 52279 ms
406444 ms: starved 4 for 1897 ms
