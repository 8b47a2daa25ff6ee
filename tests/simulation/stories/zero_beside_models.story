tractiond simulation, version 1
# A zero that was taken before something touched came into force beside it, as the disk was slow: the picture is the same
# but for noise, and without the check of the zero a model of the one before answered.
seed 1
lasts 14000 ms
4000 ms: slow-disk 1500 for 8000 ms
4500 ms: zero
4900 ms: touch 1000 for 8000 ms
5000 ms: slow-models 40 for 8000 ms
