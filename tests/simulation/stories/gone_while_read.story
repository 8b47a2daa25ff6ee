tractiond simulation, version 1
# The keeper was in a read of the camera's registers, which Aravis repeats for seconds, when the camera vanished: it stayed "streaming".
seed 1
lasts 20000 ms
5100 ms: gone for 9000 ms
9000 ms: question
