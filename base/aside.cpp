#include "base/aside.h"

#include <thread>
#include <utility>

namespace tractiond {

std::future<void> aside(std::function<void()> work) {
  std::packaged_task<void()> task(std::move(work));
  std::future<void> done = task.get_future();
  std::thread(std::move(task)).detach();
  return done;
}

}  // namespace tractiond
