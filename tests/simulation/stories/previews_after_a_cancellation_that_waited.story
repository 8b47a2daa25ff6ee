tractiond simulation, version 1
# While the gateway got no processor one client cancelled and left, and another one left. The other one's end was taken
# for that of the first, whose cancellation had not been read yet: previews were requested for nobody.
of a gateway
seed 41001861
lasts 21530 ms
3000 ms: remote-previews 146 for 14692 ms
3003 ms: remote-previews 1096 for 16137 ms
3623 ms: remote-previews 1017 for 16104 ms
17279 ms: relay-starved for 1948 ms
18387 ms: crowd 13 for 4723 ms
