set(CMAKE_CXX_STANDARD 20)
set(CMAKE_CXX_STANDARD_REQUIRED ON)
set(CMAKE_CXX_EXTENSIONS OFF)
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
set(CMAKE_EXPORT_COMPILE_COMMANDS ON)
set(CMAKE_RUNTIME_OUTPUT_DIRECTORY ${PROJECT_BINARY_DIR}/bin)

if(NOT CMAKE_BUILD_TYPE)
  set(CMAKE_BUILD_TYPE RelWithDebInfo)
endif()
set(CMAKE_CXX_FLAGS_RELWITHDEBINFO "-O2 -g1")

set(TRACTION_SANITIZE "" CACHE STRING "Sanitizers for all targets, as for -fsanitize=")
if(TRACTION_SANITIZE)
  # -O1: two thirds of the time to compile, and stacks that can be read. Null pointers stop at the address sanitizer
  # anyway; checking each costs a seventh of the compilation.
  add_compile_options(-O1 -fsanitize=${TRACTION_SANITIZE} -fno-sanitize=null -fno-sanitize-recover=all
                      -fno-omit-frame-pointer)
  add_link_options(-fsanitize=${TRACTION_SANITIZE})
endif()

# The warnings hold for our own code only; foreign headers come in as SYSTEM.
add_library(traction_warnings INTERFACE)
target_compile_options(traction_warnings INTERFACE -Wall -Wextra -Wshadow -Wconversion -Wno-sign-conversion
                                                   -Wnon-virtual-dtor -Wold-style-cast -Woverloaded-virtual -Werror)

# A static library of one room. Includes are written from the top of the tree: "daemon/base/ring.h".
function(traction_library name)
  add_library(${name} STATIC ${ARGN})
  target_include_directories(${name} PUBLIC ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE traction_warnings)
endfunction()

function(traction_executable name)
  add_executable(${name} ${ARGN})
  target_include_directories(${name} PRIVATE ${PROJECT_SOURCE_DIR})
  target_link_libraries(${name} PRIVATE traction_warnings)
endfunction()
