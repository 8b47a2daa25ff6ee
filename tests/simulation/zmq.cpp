// Defines the calls of libzmq that the daemon makes by the simulated bus. What they do is that of libzmq 4.3.
#include "tests/simulation/bus.h"

#include <zmq.h>

#include <cerrno>
#include <new>
#include <utility>

namespace {

using tractiond::simulation::bus;
using tractiond::simulation::Bus;
using tractiond::simulation::Content;
using tractiond::simulation::Part;

static_assert(sizeof(Part) <= sizeof(zmq_msg_t) && alignof(Part) <= alignof(zmq_msg_t));

Part& partOf(zmq_msg_t* message) {
  return *std::launder(reinterpret_cast<Part*>(message));
}

const Part& partOf(const zmq_msg_t* message) {
  return *std::launder(reinterpret_cast<const Part*>(message));
}

Bus::Socket& socketOf(void* socket) {
  return *static_cast<Bus::Socket*>(socket);
}

int fail(int error) {
  errno = error;
  return -1;
}

}  // namespace

extern "C" {

void* zmq_ctx_new() {
  return new int(0);
}
int zmq_ctx_set(void* /*context*/, int /*option*/, int /*value*/) {
  return 0;
}
int zmq_ctx_shutdown(void* /*context*/) {
  return 0;
}
int zmq_ctx_term(void* context) {
  delete static_cast<int*>(context);
  return 0;
}

void* zmq_socket(void* /*context*/, int type) {
  return bus()->open(type);
}
int zmq_close(void* socket) {
  bus()->close(&socketOf(socket));
  return 0;
}
int zmq_setsockopt(void* socket, int option, const void* value, std::size_t size) {
  return bus()->set(socketOf(socket), option, value, size);
}
int zmq_getsockopt(void* socket, int option, void* value, std::size_t* size) {
  return bus()->get(socketOf(socket), option, value, size);
}
int zmq_bind(void* socket, const char* endpoint) {
  return bus()->bind(socketOf(socket), endpoint);
}

int zmq_msg_init(zmq_msg_t* message) {
  new (message) Part;
  return 0;
}
int zmq_msg_init_size(zmq_msg_t* message, std::size_t size) {
  new (message) Part{std::make_shared<Content>(size)};
  return 0;
}
int zmq_msg_init_data(zmq_msg_t* message, void* data, std::size_t size, zmq_free_fn* free, void* hint) {
  new (message) Part{std::make_shared<Content>(data, size, free, hint)};
  return 0;
}
int zmq_msg_close(zmq_msg_t* message) {
  partOf(message).~Part();
  return 0;
}
int zmq_msg_move(zmq_msg_t* to, zmq_msg_t* from) {
  partOf(to) = std::exchange(partOf(from), {});
  return 0;
}
int zmq_msg_copy(zmq_msg_t* to, zmq_msg_t* from) {
  partOf(to) = partOf(from);
  return 0;
}
void* zmq_msg_data(zmq_msg_t* message) {
  const auto& content = partOf(message).content;
  return content ? content->data() : nullptr;
}
std::size_t zmq_msg_size(const zmq_msg_t* message) {
  const auto& content = partOf(message).content;
  return content ? content->size() : 0;
}
int zmq_msg_more(const zmq_msg_t* message) {
  return partOf(message).more ? 1 : 0;
}
int zmq_msg_get(const zmq_msg_t* message, int property) {
  return property == ZMQ_MORE ? zmq_msg_more(message) : fail(EINVAL);
}
const char* zmq_msg_gets(const zmq_msg_t* message, const char* property) {
  const auto& address = partOf(message).address;
  return address && std::string_view(property) == "Peer-Address" ? address->c_str() : nullptr;
}

int zmq_msg_send(zmq_msg_t* message, void* socket, int flags) {
  const auto size = static_cast<int>(zmq_msg_size(message));
  Part part = std::exchange(partOf(message), {});
  if (!part.content) part.content = std::make_shared<Content>(std::size_t{0});
  part.more = (flags & ZMQ_SNDMORE) != 0;
  bus()->send(socketOf(socket), std::move(part));
  return size;
}
int zmq_msg_recv(zmq_msg_t* message, void* socket, int /*flags*/) {
  if (!bus()->receive(socketOf(socket), partOf(message))) return fail(EAGAIN);
  return static_cast<int>(zmq_msg_size(message));
}
int zmq_send(void* socket, const void* bytes, std::size_t size, int flags) {
  bus()->send(socketOf(socket), {std::make_shared<Content>(std::string_view(static_cast<const char*>(bytes), size)),
                                 (flags & ZMQ_SNDMORE) != 0});
  return static_cast<int>(size);
}

/// Does not wait.
int zmq_poll(zmq_pollitem_t* items, int count, long /*timeout*/) {
  int ready = 0;
  for (zmq_pollitem_t* item = items; item != items + count; ++item) {
    item->revents = item->socket != nullptr && bus()->canReceive(socketOf(item->socket)) ? ZMQ_POLLIN : 0;
    ready += item->revents != 0 ? 1 : 0;
  }
  return ready;
}
}
