tractiond simulation, version 1
# What touches changes, and the thread that makes models gets no processor, or is slow. Without the bound on its age a
# model answered for seconds, without the test of the picture one of another force, and where whoever asks did not heed it
# a refused answer was published.
seed 1
lasts 14000 ms
3000 ms: touch 1000 for 9000 ms
3500 ms: touch 1800 for 8500 ms
4000 ms: starved 5 for 1500 ms
5000 ms: touch 2500 for 5000 ms
7000 ms: slow-models 120 for 2500 ms
7500 ms: touch 400 for 4000 ms
8000 ms: touch 800 for 4000 ms
9000 ms: restart
