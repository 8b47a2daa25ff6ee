"""How long tests wait for what must happen. Twin: deadline.h."""

HUNG_S = 120.0  # longer than anything takes on a busy machine: what takes longer hangs
