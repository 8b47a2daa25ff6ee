tractiond simulation, version 1
# A client repeated its subscription and left while the publishing thread got no processor. A request took its descriptor,
# and the subscription was taken for that connection's: previews were made for it.
seed 37000164
lasts 4922 ms
3000 ms: previews 115 for 139 ms
3055 ms: starved 3 for 479 ms
3217 ms: zero
