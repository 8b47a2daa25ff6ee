# A file as the elements of a C++ array of char: cmake -DINPUT=FILE -DOUTPUT=FILE -P embed.cmake
file(READ ${INPUT} bytes HEX)
string(REGEX REPLACE "(..)" "'\\\\x\\1'," elements "${bytes}")
file(WRITE ${OUTPUT} "${elements}\n")
