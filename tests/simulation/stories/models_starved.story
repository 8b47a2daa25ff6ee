tractiond simulation, version 1
# The thread that makes models got no processor, and then was slow, while what touches changed: without the bound on its
# age an old model answered for seconds.
seed 1
lasts 14000 ms
3000 ms: touch 1000 for 9000 ms
4000 ms: starved 5 for 1500 ms
4060 ms: touch 2500 for 6000 ms
7000 ms: slow-models 120 for 2500 ms
7500 ms: touch 400 for 4000 ms
8000 ms: touch 800 for 4000 ms
9000 ms: restart
