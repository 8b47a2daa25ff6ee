tractiond simulation, version 1
# A step of a calibration that sees too few markers did not end.
seed 856786706
lasts 245000 ms
212018 ms: few-markers for 27134 ms
212456 ms: noise 2304
233764 ms: broken 83 for 16972 ms
