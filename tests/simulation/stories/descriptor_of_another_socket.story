tractiond simulation, version 1
# A gateway that had got no processor read the events of its sockets one after another, took a connection for an ended
# one of another socket with the same descriptor, and counted one too few of the address.
of a gateway
seed 1668
lasts 8000 ms
3000 ms: relay-starved for 907 ms
3330 ms: strangers 18 for 138 ms
3544 ms: crowd 172 for 2789 ms
