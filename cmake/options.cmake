set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)

# A compiler cache where one is installed. What is unsafe about precompiled headers in it is that __TIME__ may be old, which
# nothing here uses. A clone at another path finds what this one has compiled: the cache takes paths below the clone as
# relative, and the compiler writes none that is not (NOHASHDIR, the prefix map).
find_program(TRACTION_CCACHE ccache)
if(TRACTION_CCACHE)
  foreach(language C CXX)
    set(CMAKE_${language}_COMPILER_LAUNCHER
        ${CMAKE_COMMAND} -E env CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
        CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=1 ${TRACTION_CCACHE})
  endforeach()
endif()

add_compile_options(-ffile-prefix-map=${PROJECT_SOURCE_DIR}/=)  # debuggers: start them at the top of the tree

if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE RelWithDebInfo)
endif()
# The same code in both, with its assertions; without debug information the demo is there sooner.
set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O2 -g1")
set(CMAKE_CXX_FLAGS_RELEASE "-O2")

set(TRACTION_SANITIZE "" CACHE STRING "Sanitizers for all targets, as for -fsanitize=")
if(TRACTION_SANITIZE)
  # -O1: two thirds of the time to compile, and stacks that can be read. Null pointers and accesses beyond an object stop
  # at the address sanitizer anyway; checking each costs a fifth of the compilation.
  add_compile_options(-O1 -fsanitize=${TRACTION_SANITIZE} -fno-sanitize=null,object-size -fno-sanitize-recover=all
                      -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${TRACTION_SANITIZE})
endif()

# A package without one of its programs would fail in its last step, after all was compiled.
option(TRACTION_ALL_PROGRAMS "Fail where something is missing that traction-lens or traction-view needs; debian/rules sets it" OFF)
set(TRACTION_LEFT_OUT STATUS)
if(TRACTION_ALL_PROGRAMS)
  set(TRACTION_LEFT_OUT FATAL_ERROR)
endif()

option(TRACTION_FUZZ "tests/fuzz for libFuzzer, and no other tests; needs Clang" OFF)
if(TRACTION_FUZZ)
  add_compile_options(-fsanitize=fuzzer-no-link)
endif()

# The warnings hold for our own code only; foreign headers come in as SYSTEM. They are errors only where continuous
# integration builds the packages (.ci/run): another compiler's warnings prevent nobody from building.
add_library(traction_warnings INTERFACE)
target_compile_options(traction_warnings INTERFACE -Wall -Wextra -Wshadow -Wconversion -Wno-sign-conversion
                                                   -Wnon-virtual-dtor -Wold-style-cast -Woverloaded-virtual)

# Four fifths of what the smaller files cost to compile are the headers of Eigen and the standard library. Which headers a
# file needs it says itself: the dev preset and tools/lint read them one by one.
option(TRACTION_QUICK "Compile sooner: common headers are read once for all, tests are optimised less" OFF)
if(TRACTION_QUICK)
  add_compile_options(-pthread)  # as Aravis's own flags: it defines a macro, which must not differ
  if(CMAKE_CXX_COMPILER_ID STREQUAL GNU)
    # A seventh of the compiler's time goes into keeping its memory small. At most 0.6 GB more for each file.
    add_compile_options(--param=ggc-min-expand=1000 --param=ggc-min-heapsize=524288)
  endif()
endif()

# A target of nothing but the headers, for others of the same options. Code of libraries is independent of its position,
# that of executables only among themselves: traction_headers(NAME LIBRARY|EXECUTABLE HEADER...)
function(traction_headers name kind)
  if(NOT TRACTION_QUICK)
    return()
  endif()
  set(source ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
  file(CONFIGURE OUTPUT ${source} CONTENT "int main() {}\n")
  if(kind STREQUAL LIBRARY)
    add_library(${name} OBJECT ${source})
  else()
    add_executable(${name} ${source})
  endif()
  target_link_libraries(${name} PRIVATE Eigen3::Eigen tl::expected traction_warnings)
  target_precompile_headers(${name} PRIVATE ${ARGN})
  target_compile_options(${name} PRIVATE -fpch-preprocess)  # or ccache cannot read it
endfunction()

# Lets a target use them.
function(traction_use_headers target name)
  if(TARGET ${name})
    target_precompile_headers(${target} REUSE_FROM ${name})
    target_compile_options(${target} PRIVATE -fpch-preprocess)
  endif()
endfunction()

set(traction_common_headers
    <algorithm> <array> <atomic> <chrono> <cmath> <condition_variable> <filesystem> <fstream> <functional> <map> <memory>
    <mutex> <numbers> <optional> <random> <span> <sstream> <string> <string_view> <thread> <tuple> <utility> <variant>
    <vector> <Eigen/Dense> <tl/expected.hpp>)
traction_headers(traction_library_headers LIBRARY ${traction_common_headers})

# A static library of one room. Includes are written from the top of the tree: "base/ring.h".
function(traction_library name)
  add_library(${name} STATIC ${ARGN})
  target_include_directories(${name} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE traction_warnings)
  traction_use_headers(${name} traction_library_headers)
endfunction()

# The files of a target as one: what their headers bring is instantiated once. Names in unnamed namespaces must differ.
function(traction_together target)
  if(TRACTION_QUICK)
    set_target_properties(${target} PROPERTIES UNITY_BUILD ON)
  endif()
endfunction()

# Code that a program of others has written: half of its compilation under sanitizers is the search for undefined behaviour.
function(traction_generated target)
  if(TRACTION_SANITIZE MATCHES undefined)
    target_compile_options(${target} PRIVATE -fno-sanitize=undefined)
  endif()
endfunction()

# A room of matrices, in which no file but those named takes bytes for something else: Eigen asserts the alignment of its
# own memory, and checking each of its expressions' references again is a third of the compilation under sanitizers.
function(traction_matrices target)
  if(TRACTION_SANITIZE MATCHES undefined)
    target_compile_options(${target} PRIVATE -fno-sanitize=alignment)
    set_source_files_properties(${ARGN} PROPERTIES COMPILE_OPTIONS -fsanitize=alignment)
  endif()
endfunction()

# What is called once when a program starts, and need not be fast: not optimised, it is compiled in a third of the time.
function(traction_cold)
  if(TRACTION_QUICK)
    set_source_files_properties(${ARGN} PROPERTIES COMPILE_OPTIONS -O0 SKIP_PRECOMPILE_HEADERS ON)
  endif()
endfunction()

function(traction_executable name)
  add_executable(${name} ${ARGN})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE traction_warnings)
endfunction()
