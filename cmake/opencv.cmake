# OpenCV's parts by their headers and libraries: what CMake itself finds OpenCV by comes with Debian's libopencv-dev,
# which needs twice the room. traction_opencv for traction-lens; absent where something
# of it is.
find_path(OPENCV_INCLUDE opencv2/core.hpp PATH_SUFFIXES opencv4)

function(traction_opencv_parts name)
  set(libraries)
  foreach(part ${ARGN})
    find_library(OPENCV_${part} opencv_${part})
    if(NOT OPENCV_INCLUDE OR NOT OPENCV_${part} OR NOT EXISTS ${OPENCV_INCLUDE}/opencv2/${part}.hpp)
      return()
    endif()
    list(APPEND libraries ${OPENCV_${part}})
  endforeach()
  add_library(${name} INTERFACE)
  target_include_directories(${name} SYSTEM INTERFACE ${OPENCV_INCLUDE})
  target_link_libraries(${name} INTERFACE ${libraries})
endfunction()

traction_opencv_parts(traction_opencv calib3d imgcodecs imgproc core)
