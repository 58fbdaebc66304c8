// SPDX-License-Identifier: Apache-2.0
#include "apps/terminal/interrupt.h"

#include <semaphore.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <csignal>
#include <string_view>
#include <thread>

namespace polarscan {
namespace {

constexpr std::chrono::milliseconds kPatience{800};

// What a signal handler may reach.
std::atomic<Progress*> interruptible = nullptr;
std::atomic<bool> in_its_own_time = false;
sem_t interrupted;

void Write(std::string_view text) {
  [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, text.data(), text.size());
}

extern "C" void OnInterrupt(int) {
  if (Progress* progress = interruptible.load()) progress->Cancel();
  Write("\nstopping (Ctrl-C again: at once, without tidying up)\n");
  sem_post(&interrupted);
}

void EndWhatDoesNotStop() {
  while (sem_wait(&interrupted) != 0) continue;
  std::this_thread::sleep_for(kPatience);
  if (in_its_own_time) return;
  Write("polarscan: stopped; run the same command again to go on\n");
  _exit(1);
}

}  // namespace

StopOnInterrupt::StopOnInterrupt(Progress& progress) {
  interruptible = &progress;
  sem_init(&interrupted, 0, 0);
  std::thread(EndWhatDoesNotStop).detach();
  struct sigaction action = {};
  action.sa_handler = OnInterrupt;
  action.sa_flags = int(SA_RESETHAND);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

StopOnInterrupt::~StopOnInterrupt() {
  std::signal(SIGINT, SIG_IGN);
  std::signal(SIGTERM, SIG_IGN);
  interruptible = nullptr;
}

void EndInItsOwnTime() { in_its_own_time = true; }

}  // namespace polarscan
