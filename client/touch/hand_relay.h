// Fields of a hand's fingers in, grasps out.
#pragma once

#include "client/touch/grasper.h"
#include "client/touch/hand_file.h"
#include "client/touch/publisher.h"
#include "traction/subscriber.h"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

namespace traction::contacts {

/// What one turn of the program's only loop does. Thread-bound.
class HandRelay {
 public:
  /// \param boot of the messages
  /// \throws Error as Subscriber does
  HandRelay(const HandFile& hand, const Id& boot, Publisher& publisher);

  /// Waits some time for fields, and publishes the grasps that they complete; or, where none was complete for
  /// Grasper::silence_ns(), what is known of the fingers.
  void turn();
  void endAll() {}

  std::string statusLine() const;

 private:
  struct Source {
    std::string instance;
    Subscriber subscriber;
    std::int64_t heard_ns = 0;
  };
  bool receive(std::size_t index, std::chrono::milliseconds patience);
  void send(const v1::Grasp& grasp);
  void tell();

  Publisher& publisher_;
  Grasper grasper_;
  std::vector<Source> fingers_;
  std::string said_, news_;  ///< status lines: in the log, and since newsSince_ns_
  std::string now_ = "starts";
  std::int64_t sent_ns_, newsSince_ns_ = 0, errorTold_ns_ = 0;
};

}  // namespace traction::contacts
