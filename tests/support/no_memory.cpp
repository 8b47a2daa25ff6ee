// Linked into a test program (no_memory.h), or preloaded (LD_PRELOAD): then as many of the control thread's messages
// fail as $TRACTION_NO_MEMORY says.
#include "tests/support/no_memory.h"

#include <dlfcn.h>
#include <pthread.h>
#include <zmq.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <string_view>

namespace tractiond::test {

thread_local int memoryLeft = -1;

namespace {

int toFail() {
  const char* const count = std::getenv("TRACTION_NO_MEMORY");
  return count == nullptr ? 0 : std::atoi(count);
}

bool mustFail() {
  static std::atomic<int> left{toFail()};
  if (memoryLeft > 0) return memoryLeft--, false;
  if (memoryLeft == 0) return true;
  if (left == 0) return false;
  std::array<char, 16> name{};
  pthread_getname_np(pthread_self(), name.data(), name.size());
  return name.data() == std::string_view("tr-control") && left-- > 0;
}

template <typename Function, typename... Arguments>
int unlessMemoryLacks(const char* name, Function /*as declared*/, Arguments... arguments) {
  if (!mustFail()) return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name))(arguments...);
  errno = ENOMEM;
  return -1;
}

}  // namespace
}  // namespace tractiond::test

extern "C" {
int zmq_msg_copy(zmq_msg_t* to, zmq_msg_t* from) {
  return tractiond::test::unlessMemoryLacks("zmq_msg_copy", zmq_msg_copy, to, from);
}
int zmq_msg_init_data(zmq_msg_t* message, void* data, std::size_t size, zmq_free_fn* free, void* hint) {
  return tractiond::test::unlessMemoryLacks("zmq_msg_init_data", zmq_msg_init_data, message, data, size, free, hint);
}
int zmq_msg_init_size(zmq_msg_t* message, std::size_t size) {
  return tractiond::test::unlessMemoryLacks("zmq_msg_init_size", zmq_msg_init_size, message, size);
}
}
