#include "base/background_thread.h"

#include <pthread.h>

#include <condition_variable>
#include <mutex>
#include <queue>
#include <thread>
#include <utility>

namespace tractiond {

struct BackgroundThread::State {
  std::shared_ptr<Event> idle;
  std::mutex mutex;
  std::condition_variable changed;
  // Guarded by it.
  std::queue<std::function<void()>> work;
  bool isBusy = false;  ///< a piece of work is being done
  bool ends = false;

  void loop() {
    for (std::unique_lock lock(mutex);;) {
      changed.wait(lock, [this] { return ends || !work.empty(); });
      if (work.empty()) return;
      std::function<void()> next = std::move(work.front());
      work.pop();
      isBusy = true;
      lock.unlock();
      next();
      next = {};  // destroys what it holds
      lock.lock();
      isBusy = false;
      if (!work.empty()) continue;
      changed.notify_all();
      if (idle) idle->signal();
    }
  }
};

BackgroundThread::BackgroundThread(const char* name, std::shared_ptr<Event> idle)
    : state_(std::make_shared<State>()) {
  state_->idle = std::move(idle);
  std::thread([name, state = state_] {
    pthread_setname_np(pthread_self(), name);
    state->loop();
  }).detach();
}

BackgroundThread::~BackgroundThread() {
  const std::lock_guard lock(state_->mutex);
  state_->ends = true;
  state_->changed.notify_all();
}

void BackgroundThread::run(std::function<void()> work) {
  const std::lock_guard lock(state_->mutex);
  state_->work.push(std::move(work));
  state_->changed.notify_all();
}

bool BackgroundThread::awaitIdle(std::chrono::milliseconds patience) const {
  std::unique_lock lock(state_->mutex);
  return state_->changed.wait_for(lock, patience, [this] { return state_->work.empty() && !state_->isBusy; });
}

}  // namespace tractiond
