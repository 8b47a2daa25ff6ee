tractiond simulation, version 1
# The camera had just come back, so that a zero might take longer; who asked for one a little later was told a shorter time, and answered with the first.
seed 79009
lasts 280251 ms
84117 ms: zero
186063 ms: full-disk for 5515 ms
187568 ms: undo
187618 ms: gone for 15366 ms
191578 ms: slow-disk 16376 for 90000 ms
205259 ms: zero
213075 ms: zero
