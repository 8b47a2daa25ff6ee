tractiond simulation, version 1
# A client that wants previews connected again. The end of its old connection was told before the descriptor was closed,
# and its new subscription was taken for a repetition of the old one: no previews were made for it.
seed 2
lasts 8000 ms
3000 ms: previews 372 for 54979 ms
