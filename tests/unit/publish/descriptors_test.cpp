// The committed descriptor set is the promise to those who read our messages today; the .proto files must keep it.

#include "tests/support/places.h"

#include <google/protobuf/descriptor.pb.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <set>

namespace {

using google::protobuf::DescriptorProto;
using google::protobuf::EnumDescriptorProto;
using google::protobuf::FieldDescriptorProto;
using google::protobuf::FileDescriptorSet;

struct Contract {
  std::map<std::string, DescriptorProto> messages;
  std::map<std::string, EnumDescriptorProto> enums;
};

void add(const std::string& scope, const DescriptorProto& message, Contract& contract) {
  const std::string name = scope + message.name();
  contract.messages[name] = message;
  for (const auto& nested : message.nested_type()) add(name + ".", nested, contract);
  for (const auto& nested : message.enum_type()) contract.enums[name + "." + nested.name()] = nested;
}

FileDescriptorSet read(const std::string& path) {
  FileDescriptorSet files;
  std::ifstream stream(path, std::ios::binary);
  EXPECT_TRUE(files.ParseFromIstream(&stream)) << path;
  return files;
}

Contract contractOf(const FileDescriptorSet& files) {
  Contract contract;
  for (const auto& file : files.file()) {
    for (const auto& message : file.message_type()) add(file.package() + ".", message, contract);
    for (const auto& type : file.enum_type()) contract.enums[file.package() + "." + type.name()] = type;
  }
  return contract;
}

std::set<int> reservedNumbers(const DescriptorProto& message) {
  std::set<int> numbers;
  for (const auto& range : message.reserved_range()) {
    for (int number = range.start(); number < range.end(); ++number) numbers.insert(number);
  }
  return numbers;
}

/// Name, number and type; options say only what is shown where.
std::string plain(FieldDescriptorProto field) {
  field.clear_options();
  return field.SerializeAsString();
}

/// One line for everything that a reader of `before` would misread in `now`.
std::vector<std::string> breaks(const Contract& before, const Contract& now) {
  std::vector<std::string> found;
  for (const auto& [name, old] : before.messages) {
    const auto message = now.messages.find(name);
    if (message == now.messages.end()) {
      found.push_back(name + " is gone");
      continue;
    }
    std::map<int, const FieldDescriptorProto*> fields;
    for (const auto& field : message->second.field()) fields[field.number()] = &field;
    for (const auto& field : old.field()) {
      const std::string which = name + "." + field.name() + " = " + std::to_string(field.number());
      const auto same = fields.find(field.number());
      if (same == fields.end() || plain(*same->second) != plain(field)) found.push_back(which + " is gone or another");
    }
    // A reserved number waits for the field whose name is reserved with it.
    const std::set<std::string> names(old.reserved_name().begin(), old.reserved_name().end());
    for (const int number : reservedNumbers(old)) {
      const auto field = fields.find(number);
      if (field != fields.end() ? !names.contains(field->second->name())
                                : !reservedNumbers(message->second).contains(number)) {
        found.push_back(name + ": number " + std::to_string(number) + " was reserved");
      }
    }
  }
  for (const auto& [name, old] : before.enums) {
    const auto type = now.enums.find(name);
    std::map<int, std::string> values;
    if (type != now.enums.end()) {
      for (const auto& value : type->second.value()) values[value.number()] = value.name();
    }
    for (const auto& value : old.value()) {
      if (values[value.number()] != value.name()) found.push_back(name + "." + value.name() + " is gone or moved");
    }
  }
  return found;
}

FileDescriptorSet readCommitted() {
  return read(tractiond::test::source("proto/traction/v1.descriptors"));
}
FileDescriptorSet readBuilt() {
  return read(tractiond::test::built("proto/cpp/v1.descriptors"));
}

TEST(Descriptors, CommittedContractIsKept) {
  for (const std::string& line : breaks(contractOf(readCommitted()), contractOf(readBuilt()))) ADD_FAILURE() << line;
}

TEST(Descriptors, CommittedContractIsComplete) {
  EXPECT_EQ(readBuilt().SerializeAsString(), readCommitted().SerializeAsString())
      << "the .proto files have grown: ninja commit_descriptors";
}

}  // namespace
