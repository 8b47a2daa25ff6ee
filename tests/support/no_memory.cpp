// Preloaded (LD_PRELOAD): the first COUNT messages of the thread THREAD fail, as if there was no memory for them, if
// $TRACTION_NO_MEMORY is THREAD:COUNT.
#include <dlfcn.h>
#include <pthread.h>
#include <zmq.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstdlib>
#include <string_view>

namespace tractiond::test {
namespace {

std::string_view wanted() {
  const char* const given = std::getenv("TRACTION_NO_MEMORY");
  return given == nullptr ? ":0" : given;
}

bool mustFail() {
  static const std::string_view thread = wanted().substr(0, wanted().find(':'));
  static std::atomic<int> left{std::atoi(wanted().data() + thread.size() + 1)};
  if (left == 0) return false;
  std::array<char, 16> name{};
  pthread_getname_np(pthread_self(), name.data(), name.size());
  return name.data() == thread && left-- > 0;
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
int zmq_msg_init_data(zmq_msg_t* message, void* data, std::size_t size, zmq_free_fn* free, void* hint) {
  return tractiond::test::unlessMemoryLacks("zmq_msg_init_data", zmq_msg_init_data, message, data, size, free, hint);
}
#if ZMQ_VERSION >= ZMQ_MAKE_VERSION(4, 3, 5)  // before, it calls zmq_msg_init_size()
int zmq_send(void* socket, const void* data, std::size_t size, int flags) {
  return tractiond::test::unlessMemoryLacks("zmq_send", zmq_send, socket, data, size, flags);
}
#endif
int zmq_msg_init_size(zmq_msg_t* message, std::size_t size) {
  return tractiond::test::unlessMemoryLacks("zmq_msg_init_size", zmq_msg_init_size, message, size);
}
}
