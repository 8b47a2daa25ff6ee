tractiond simulation, version 1
# Requests that waited of an earlier connection with its file descriptor were taken for those of a subscriber that flooded.
seed 3000025
lasts 555994 ms
552073 ms: unread-requests 2584 for 6890 ms
553985 ms: subscriptions 334
