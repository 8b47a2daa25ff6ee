#include "client/cli/npz.h"

#include "recording/bytes.h"
#include "recording/records.h"

#include <fcntl.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <cstring>
#include <utility>

namespace traction::client {

namespace {

static_assert(std::endian::native == std::endian::little, "rows are written as they are in memory");

using recording::Output;

constexpr std::size_t kWaiting = 1 << 16;  ///< bytes of a member that are collected before they are written
constexpr std::uint16_t kZip64 = 45;       ///< the version of the format that has sizes of eight bytes
constexpr std::uint16_t kDate = 0x21;      ///< 1980-01-01
constexpr std::uint32_t kElsewhere = UINT32_MAX;
constexpr std::uint16_t kLocalExtra = 2 + 2 + 8 + 8, kCentralExtra = kLocalExtra + 8;

/// Returns the header of a .npy file, version 1: a multiple of 64 bytes.
std::string headOf(const NpzWriter::Array& array) {
  std::string shape = std::to_string(array.rows) + ",";
  for (const std::size_t size : array.row) shape += " " + std::to_string(size) + ",";
  std::string text = "{'descr': '" + array.type + "', 'fortran_order': False, 'shape': (" + shape + "), }";
  constexpr std::size_t kBefore = 6 + 2 + 2;
  text.append(63 - (kBefore + text.size()) % 64, ' ');
  text += '\n';
  std::string head("\x93NUMPY\x01\x00", 8);
  Output(head).number(static_cast<std::uint16_t>(text.size())).bytes(text);
  return head;
}

}  // namespace

std::size_t NpzWriter::Array::rowBytes() const {
  std::size_t bytes = element_bytes;
  for (const std::size_t size : row) bytes *= size;
  return bytes;
}

NpzWriter::NpzWriter(const std::string& path, const std::vector<Array>& arrays)
    : fd_(open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666)) {
  if (fd_ < 0) throw NpzError(std::strerror(errno));
  for (const Array& array : arrays) {
    const std::string head = headOf(array);
    Member& member = members_.emplace_back();
    member.name = array.name + ".npy";
    member.start = end_;
    member.size = head.size() + array.rows * array.rowBytes();
    member.next = end_ + localHeader(member).size();
    end_ = member.next + member.size;
    put(member, head);
  }
}

NpzWriter::~NpzWriter() {
  if (fd_ >= 0) close(fd_);
}

void NpzWriter::add(std::size_t array, std::string_view row) {
  put(members_.at(array), row);
}

void NpzWriter::put(Member& member, std::string_view bytes) {
  member.crc = recording::crcOf(bytes, member.crc);
  member.waiting += bytes;
  if (member.waiting.size() >= kWaiting) flush(member);
}

void NpzWriter::flush(Member& member) {
  writeAt(member.next, member.waiting);
  member.next += member.waiting.size();
  member.waiting.clear();
}

void NpzWriter::writeAt(std::uint64_t offset, std::string_view bytes) const {
  while (!bytes.empty()) {
    const ssize_t written = pwrite(fd_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0) throw NpzError(std::strerror(written < 0 ? errno : ENOSPC));
    offset += static_cast<std::uint64_t>(written);
    bytes.remove_prefix(static_cast<std::size_t>(written));
  }
}

std::string NpzWriter::localHeader(const Member& member) {
  std::string header;
  Output out(header);
  out.bytes("PK\x03\x04").number(kZip64).number(std::uint16_t{0}).number(std::uint16_t{0});  // no flags, not compressed
  out.number(std::uint16_t{0}).number(kDate).number(member.crc).number(kElsewhere).number(kElsewhere);
  out.number(static_cast<std::uint16_t>(member.name.size())).number(kLocalExtra).bytes(member.name);
  out.number(std::uint16_t{1}).number(std::uint16_t{16}).number(member.size).number(member.size);
  return header;
}

void NpzWriter::finish() {
  std::string directory;
  Output out(directory);
  for (Member& member : members_) {
    flush(member);
    writeAt(member.start, localHeader(member));
    out.bytes("PK\x01\x02").number(kZip64).number(kZip64).number(std::uint16_t{0}).number(std::uint16_t{0});
    out.number(std::uint16_t{0}).number(kDate).number(member.crc).number(kElsewhere).number(kElsewhere);
    out.number(static_cast<std::uint16_t>(member.name.size())).number(kCentralExtra);
    out.bytes(std::string(2 + 2 + 2 + 4, '\0')).number(kElsewhere).bytes(member.name);  // no comment, no attributes
    out.number(std::uint16_t{1}).number(std::uint16_t{24});
    out.number(member.size).number(member.size).number(member.start);
  }
  const std::uint64_t size = directory.size(), count = members_.size();
  out.bytes("PK\x06\x06").number(std::uint64_t{44}).number(kZip64).number(kZip64).number(std::uint64_t{0});
  out.number(count).number(count).number(size).number(end_);
  out.bytes("PK\x06\x07").number(std::uint32_t{0}).number(end_ + size).number(std::uint32_t{1});
  out.bytes("PK\x05\x06").number(std::uint32_t{0}).number(static_cast<std::uint16_t>(count));
  out.number(static_cast<std::uint16_t>(count)).number(kElsewhere).number(kElsewhere).number(std::uint16_t{0});
  writeAt(end_, directory);
  if (close(std::exchange(fd_, -1)) != 0) throw NpzError(std::strerror(errno));
}

}  // namespace traction::client
