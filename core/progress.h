// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <atomic>
#include <cstddef>
#include <string>
#include <vector>

#include "core/error.h"

namespace polarscan {

// How a stage tells its caller how far it is, and learns that it should stop. All members may be called from
// any thread. The base class is silent; apps/ shows progress on the terminal and collects warnings into
// scan.json.
class Progress {
 public:
  virtual ~Progress() = default;

  // A counted step begins: `total` units of work ("view", "picture", ...) are ahead.
  virtual void Begin(const std::string& /*step*/, std::size_t /*total*/,
                     const std::string& /*unit*/ = "view") {}
  virtual void Advance(std::size_t /*units*/ = 1) {}
  // Something the user should know, which does not stop the work.
  virtual void Warn(const std::string& /*message*/) {}
  virtual void Info(const std::string& /*message*/) {}
  // The current step is over.
  virtual void End() {}
  // The warnings since the last call, where they are kept.
  virtual std::vector<std::string> TakeWarnings() { return {}; }

  void Cancel() { cancelled_ = true; }
  bool cancelled() const { return cancelled_; }
  // Throws Cancelled if the user asked to stop. Call it at least every few hundred milliseconds of work.
  void Check() const {
    if (cancelled_) throw Cancelled();
  }

 private:
  std::atomic<bool> cancelled_{false};
};

}  // namespace polarscan
