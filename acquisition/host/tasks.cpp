// SPDX-License-Identifier: Apache-2.0
#include "acquisition/host/tasks.h"

#include <fmt/format.h>

#include <chrono>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>

namespace polarscan {
namespace {

using Clock = std::chrono::steady_clock;

// A task on a thread of its own. Nobody waits for the thread: what it uses lives as long as it does.
class Running {
 public:
  explicit Running(const HostTask& task) : task_(task), shared_(std::make_shared<Shared>()) {
    std::thread([shared = shared_, task] {
      const std::vector<HostCheck> checks = Run(task, shared->progress);
      const std::lock_guard lock(shared->mutex);
      shared->checks = checks;
      shared->done.notify_all();
    }).detach();
  }
  ~Running() { shared_->progress.Cancel(); }
  Running(const Running&) = delete;

  std::vector<HostCheck> Wait(Clock::time_point began, const Progress& progress) {
    const auto limit =
        began + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(task_.limit_s));
    std::unique_lock lock(shared_->mutex);
    while (!shared_->checks && Clock::now() < limit) {
      progress.Check();
      shared_->done.wait_for(lock, std::chrono::milliseconds(50));
    }
    if (shared_->checks) return *shared_->checks;
    return {{task_.name, CheckState::kWarning, fmt::format("no answer in {:g} s", task_.limit_s), "an answer",
             task_.fix}};
  }

 private:
  struct Shared {
    Progress progress;
    std::mutex mutex;
    std::condition_variable done;
    std::optional<std::vector<HostCheck>> checks;
  };

  static std::vector<HostCheck> Run(const HostTask& task, Progress& progress) {
    try {
      return task.run(progress);
    } catch (const std::exception& error) {
      return {{task.name, CheckState::kBad, error.what(), "", task.fix}};
    }
  }

  HostTask task_;
  std::shared_ptr<Shared> shared_;
};

}  // namespace

std::vector<HostCheck> RunHostTasks(const std::vector<HostTask>& tasks, const Progress& progress) {
  const Clock::time_point began = Clock::now();
  std::vector<std::unique_ptr<Running>> running;
  for (const HostTask& task : tasks) running.push_back(std::make_unique<Running>(task));
  std::vector<HostCheck> checks;
  for (const auto& task : running) {
    const std::vector<HostCheck> more = task->Wait(began, progress);
    checks.insert(checks.end(), more.begin(), more.end());
  }
  return checks;
}

}  // namespace polarscan
