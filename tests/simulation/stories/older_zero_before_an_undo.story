tractiond simulation, version 1
# The disk lost what it had acknowledged: the zero in force was restored, with an older one before it.
seed 25004643
lasts 16986 ms
3000 ms: zero
6000 ms: lying-disk for 31469 ms
9000 ms: zero
9960 ms: undo
12960 ms: power-cut
15960 ms: undo
