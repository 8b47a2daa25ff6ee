tractiond simulation, version 1
# The camera's next picture overtook its own of the forged one's id: the law wanted a flag before anything showed the forgery.
seed 128
lasts 5000 ms
3000 ms: late 44 for 30 ms
3003 ms: impostor 50 for 900 ms
