// The program's own malloc, pthread_mutex_lock, zmq_* and arv_* come before those of the shared libraries, also for
// calls from other shared libraries. They count and pass on.
#include "tests/unit/app/interposed.h"

#include <dlfcn.h>
#include <pthread.h>
#include <zmq.h>

#include <atomic>
#include <cerrno>
#include <cstddef>

extern "C" {
// glibc's own names of what is replaced here.
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);
}

namespace tractiond::interposed {
namespace {

struct AtomicCounts {
  std::atomic<std::uint64_t> allocations{0}, frees{0}, locks{0};
  Counts get() const { return {allocations, frees, locks}; }
};

std::atomic<bool> counting{false};
AtomicCounts own, libraries;
thread_local bool marked = false;
thread_local int insideLibrary = 0;

void note(std::atomic<std::uint64_t> AtomicCounts::*what) {
  if (!marked || !counting.load(std::memory_order_relaxed)) return;
  AtomicCounts& counts = insideLibrary > 0 ? libraries : own;
  ++(counts.*what);
}

struct Inside {
  Inside() { ++insideLibrary; }
  ~Inside() { --insideLibrary; }
};

template <typename Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

}  // namespace

void markThisThread() {
  marked = true;
}
void count(bool on) {
  counting = on;
}
Counts ours() {
  return own.get();
}
Counts ofLibraries() {
  return libraries.get();
}

}  // namespace tractiond::interposed

using namespace tractiond::interposed;

// NOLINTBEGIN: the names and types are those of the libraries
extern "C" {

void* malloc(std::size_t size) {
  note(&AtomicCounts::allocations);
  return __libc_malloc(size);
}
void* calloc(std::size_t count, std::size_t size) {
  note(&AtomicCounts::allocations);
  return __libc_calloc(count, size);
}
void* realloc(void* old, std::size_t size) {
  note(&AtomicCounts::allocations);
  return __libc_realloc(old, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
  note(&AtomicCounts::allocations);
  return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
  return memalign(alignment, size);
}
int posix_memalign(void** result, std::size_t alignment, std::size_t size) {
  *result = memalign(alignment, size);
  return *result ? 0 : ENOMEM;
}
void free(void* memory) {
  if (memory) note(&AtomicCounts::frees);
  __libc_free(memory);
}
int pthread_mutex_lock(pthread_mutex_t* mutex) {
  note(&AtomicCounts::locks);
  static const auto real = next<int (*)(pthread_mutex_t*)>("pthread_mutex_lock");
  return real(mutex);
}

#define PASS_ON(result, name, parameters, arguments)                                                                   \
  result name parameters {                                                                                             \
    static const auto real = next<result(*) parameters>(#name);                                                        \
    const Inside inside;                                                                                               \
    return real arguments;                                                                                             \
  }

PASS_ON(int, zmq_msg_init, (zmq_msg_t * m), (m))
PASS_ON(int, zmq_msg_init_size, (zmq_msg_t * m, std::size_t s), (m, s))
PASS_ON(int, zmq_msg_init_data, (zmq_msg_t * m, void* d, std::size_t s, zmq_free_fn* f, void* h), (m, d, s, f, h))
PASS_ON(int, zmq_msg_send, (zmq_msg_t * m, void* s, int f), (m, s, f))
PASS_ON(int, zmq_msg_recv, (zmq_msg_t * m, void* s, int f), (m, s, f))
PASS_ON(int, zmq_msg_close, (zmq_msg_t * m), (m))
PASS_ON(int, zmq_msg_copy, (zmq_msg_t * to, zmq_msg_t* from), (to, from))
PASS_ON(int, zmq_send, (void* s, const void* b, std::size_t l, int f), (s, b, l, f))
PASS_ON(int, zmq_poll, (zmq_pollitem_t * i, int n, long t), (i, n, t))
PASS_ON(void*, arv_stream_timeout_pop_buffer, (void* s, std::uint64_t t), (s, t))
PASS_ON(void, arv_stream_push_buffer, (void* s, void* b), (s, b))
PASS_ON(int, zmq_getsockopt, (void* s, int o, void* v, std::size_t* l), (s, o, v, l))
}
// NOLINTEND
