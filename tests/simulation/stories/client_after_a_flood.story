tractiond simulation, version 1
# A client that sent too many requests was cut off; those that waited were counted for the next one with its file descriptor, which was cut off, too.
seed 516163500
lasts 260241 ms
257071 ms: unread-requests 2906 for 8877 ms
258461 ms: zero
