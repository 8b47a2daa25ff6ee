// Passes work from other threads to the server's.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>

#include <atomic>
#include <utility>

namespace traction::view {

/// Bounds what waits for the server's thread, of one source. Thread-safe.
class Backlog {
 public:
  /// \param context of the server's thread; must outlive the object
  explicit Backlog(boost::asio::io_context& context)
      : context_(context) {}

  /// Has work() called on the server's thread; drops it if 1,000 wait already. The object must live until then.
  template <typename Work>
  void post(Work work) {
    constexpr int kMost = 1000;
    if (waiting_.load() >= kMost) return;
    ++waiting_;
    boost::asio::post(context_, [this, work = std::move(work)]() mutable {
      --waiting_;
      work();
    });
  }

 private:
  boost::asio::io_context& context_;
  std::atomic<int> waiting_{0};
};

}  // namespace traction::view
