tractiond simulation, version 1
# Five pictures that waited while the camera was opened come at once within a stall: the links, which the law wanted to bridge it, lose one.
seed 17000227
lasts 1195 ms
82 ms: starved 1 for 71 ms
