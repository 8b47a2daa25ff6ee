// Lets one build use the vector units of each machine of the architecture.
//
// The macro precedes a function's definition: the compiler makes a version for each level of x86-64, and the loader
// picks one at the program's start. The loop must use vector types or be plain enough for the compiler to vectorise it;
// functions that it calls are part of a version only if they are inlined. There is one version alone, for the build's
// own target, elsewhere, under clang 14 (whose versions no other file reaches), and under sanitizers (whose run time
// is not up yet when the loader picks). The versions round differently: those of
// x86-64-v3 and v4 fuse multiplications with additions and sum in another order.
#pragma once

#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) &&          \
    !defined(__SANITIZE_THREAD__)
#define TRACTION_VECTOR_CLONES __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
#else
#define TRACTION_VECTOR_CLONES
#endif
