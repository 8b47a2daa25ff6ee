tractiond simulation, version 1
# A stop waited for a reload whose file a disk did not give: systemd killed the daemon, and what stops after it did not stop.
seed 1
lasts 60000 ms
5000 ms: slow-disk 40000 for 50000 ms
6000 ms: reopen 0
8000 ms: restart
