# Every dependency is a Debian 12 package; tools/dependencies lists them.
find_package(PkgConfig REQUIRED)
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(Protobuf REQUIRED)
find_package(spdlog REQUIRED)
find_package(tl-expected REQUIRED)
find_package(CLI11 REQUIRED)
pkg_check_modules(aravis REQUIRED IMPORTED_TARGET aravis-0.8)
pkg_check_modules(zmq REQUIRED IMPORTED_TARGET libzmq)
pkg_check_modules(tomlplusplus REQUIRED IMPORTED_TARGET tomlplusplus)
pkg_check_modules(xxhash REQUIRED IMPORTED_TARGET libxxhash)
pkg_check_modules(openblas REQUIRED IMPORTED_TARGET openblas)
pkg_check_modules(systemd REQUIRED IMPORTED_TARGET libsystemd)

# Two modules of OpenCV; Debian's libopencv-dev, which carries its CMake package, would bring all fifty.
find_path(opencv_include opencv2/imgproc.hpp PATH_SUFFIXES opencv4 REQUIRED)
foreach(module core imgproc)
  find_library(opencv_${module}_library opencv_${module} REQUIRED)
  add_library(opencv_${module} UNKNOWN IMPORTED)
  set_target_properties(opencv_${module} PROPERTIES IMPORTED_LOCATION ${opencv_${module}_library}
                                                    INTERFACE_INCLUDE_DIRECTORIES ${opencv_include})
endforeach()

find_library(lapacke_library lapacke REQUIRED)
add_library(lapacke UNKNOWN IMPORTED)
set_target_properties(lapacke PROPERTIES IMPORTED_LOCATION ${lapacke_library})
