tractiond simulation, version 1
# A client flooded, and was disconnected. The next one with its descriptor might send as many subscriptions as that had
# left, though these had been taken before it came.
of a gateway
seed 38000085
lasts 8080 ms
3000 ms: instrument-gone for 7219 ms
6000 ms: remote-subscriptions 566 for 4072 ms
6072 ms: remote-subscriptions 219 for 3310 ms
