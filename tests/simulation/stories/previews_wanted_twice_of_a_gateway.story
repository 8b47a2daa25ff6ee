tractiond simulation, version 1
# The same through a gateway; and clients that came and left while it got no processor.
of a gateway
seed 1
lasts 34000 ms
3000 ms: remote-previews 461 for 2018 ms
3471 ms: relay-starved for 1873 ms
5063 ms: remote-slow 22 for 19301 ms
9000 ms: remote-previews 890 for 6783 ms
14852 ms: relay-starved for 1319 ms
20000 ms: remote-previews 1579 for 7996 ms
27695 ms: relay-starved for 755 ms
28124 ms: crowd 13 for 4210 ms
