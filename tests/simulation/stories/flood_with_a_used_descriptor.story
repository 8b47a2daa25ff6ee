tractiond simulation, version 1
# A subscriber flooded while subscriptions of an earlier connection with its file descriptor were held: none of its own was counted.
seed 1
lasts 30000 ms
5000 ms: subscriptions 60
8000 ms: subscriptions 300
