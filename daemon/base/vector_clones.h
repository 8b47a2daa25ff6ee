// One build for every machine of the architecture that still uses the vector units it finds.
//
// Put before a function's definition: the compiler makes a version for each level of x86-64, and the loader picks one
// at the program's start. Write the loop with vector types or so plainly that the compiler vectorises it; what the
// function calls is only part of a version if it is inlined. Elsewhere, and under sanitizers (whose run time is not up
// yet when the loader picks), there is one version for the build's own target.
#pragma once

#if defined(__has_feature)
#define TRACTION_HAS_FEATURE(x) __has_feature(x)
#else
#define TRACTION_HAS_FEATURE(x) 0
#endif

#if !defined(__x86_64__) || !defined(__gnu_linux__) || defined(__SANITIZE_ADDRESS__) ||                                \
    defined(__SANITIZE_THREAD__) || TRACTION_HAS_FEATURE(address_sanitizer) || TRACTION_HAS_FEATURE(thread_sanitizer)
#define TRACTION_VECTOR_CLONES
#elif defined(__clang__)  // clang 14 knows features, not levels
#define TRACTION_VECTOR_CLONES __attribute__((target_clones("default", "avx2", "avx512f")))
#else
#define TRACTION_VECTOR_CLONES __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
#endif
