#include "gateway/request.h"

#include "traction/v1/control.pb.h"

#include <google/protobuf/stubs/logging.h>

namespace tractiond::gateway {

namespace pb = traction::v1;

tl::expected<std::string, std::string> signedRequest(std::string_view bytes, const std::string& asker) {
  constexpr std::size_t kLargestRequest = 65'536;
  // Protobuf would otherwise write a line to standard error for each string that is not UTF-8, and block if nobody
  // reads it.
  [[maybe_unused]] static const auto before = google::protobuf::SetLogHandler(nullptr);
  // The request is parsed and serialised again: a field cannot be appended safely to bytes that end within a field.
  pb::Request request;
  if (!request.ParseFromArray(bytes.data(), static_cast<int>(bytes.size()))) {
    return tl::unexpected<std::string>("this is not a traction.v1.Request");
  }
  request.set_on_behalf_of(asker);
  std::string result = request.SerializeAsString();
  if (result.size() > kLargestRequest) return tl::unexpected<std::string>("the request is larger than 64 KiB");
  return result;
}

std::string errorReply(const std::string& sentence) {
  pb::Reply reply;
  reply.set_version(1);
  reply.set_error(sentence);
  return reply.SerializeAsString();
}

}  // namespace tractiond::gateway
