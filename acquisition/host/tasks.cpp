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
constexpr std::chrono::milliseconds kPoll{50}, kGrace{1000};  // kGrace: to tidy up when cancelled

std::vector<HostCheck> Run(const HostTask& task, Progress& progress) {
  try {
    return task.run(progress);
  } catch (const std::exception& error) {
    return {{task.name, CheckState::kBad, error.what(), "", task.fix}};
  }
}

// A task on a thread of its own. The thread may outlive this: what it uses lives as long as it does.
class RunningTask {
 public:
  explicit RunningTask(const HostTask& task) : shared_(std::make_shared<Shared>()) {
    std::thread([shared = shared_, task] {
      const std::vector<HostCheck> checks = Run(task, shared->progress);
      const std::lock_guard lock(shared->mutex);
      shared->checks = checks;
      shared->done.notify_all();
    }).detach();
  }

  void Cancel() { shared_->progress.Cancel(); }

  // Nothing if it is not done by then.
  std::optional<std::vector<HostCheck>> Wait(Clock::time_point until) {
    std::unique_lock lock(shared_->mutex);
    shared_->done.wait_until(lock, until, [this] { return shared_->checks.has_value(); });
    return shared_->checks;
  }

 private:
  struct Shared {
    Progress progress;
    std::mutex mutex;
    std::condition_variable done;
    std::optional<std::vector<HostCheck>> checks;
  };
  std::shared_ptr<Shared> shared_;
};

// Those that are still running at the end are cancelled and have a moment to tidy up.
struct RunningTasks {
  std::vector<RunningTask> list;
  ~RunningTasks() {
    for (RunningTask& task : list) task.Cancel();
    const Clock::time_point until = Clock::now() + kGrace;
    for (RunningTask& task : list) task.Wait(until);
  }
};

std::vector<HostCheck> WaitFor(RunningTask& running, const HostTask& task, Clock::time_point began,
                               const Progress& progress) {
  const std::chrono::duration<double> limit(task.limit_s);
  while (Clock::now() - began < limit) {
    progress.Check();
    if (const auto checks = running.Wait(Clock::now() + kPoll)) return *checks;
  }
  return {{task.name, CheckState::kWarning, fmt::format("no answer in {:g} s", task.limit_s), "an answer",
           task.fix}};
}

}  // namespace

std::vector<HostCheck> RunHostTasks(const std::vector<HostTask>& tasks, const Progress& progress) {
  const Clock::time_point began = Clock::now();
  RunningTasks running;
  for (const HostTask& task : tasks) running.list.emplace_back(task);
  std::vector<HostCheck> checks;
  for (std::size_t i = 0; i < tasks.size(); ++i) {
    const std::vector<HostCheck> more = WaitFor(running.list[i], tasks[i], began, progress);
    checks.insert(checks.end(), more.begin(), more.end());
  }
  return checks;
}

}  // namespace polarscan
