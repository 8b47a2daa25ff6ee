tractiond simulation, version 1
# The simulated watchdog ended the daemon 3 ms after its patience had, when the call that hung had just returned: the law saw nothing hang.
seed 18002668
lasts 111272 ms
76276 ms: silence for 3933 ms
76322 ms: hangs for 32941 ms
76469 ms: kill
