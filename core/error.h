// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <stdexcept>
#include <string>

namespace polarscan {

// Something that the user must hear about: what happened, where (path, device or view), and what to do next.
// what() is one readable sentence of the three.
class Error : public std::runtime_error {
 public:
  Error(const std::string& what, const std::string& where, const std::string& advice = "")
      : std::runtime_error(what + ": " + where + (advice.empty() ? "" : ". " + advice)),
        happened_(what),
        where_(where),
        advice_(advice) {}
  const std::string& happened() const { return happened_; }
  const std::string& where() const { return where_; }
  const std::string& advice() const { return advice_; }

 private:
  std::string happened_, where_, advice_;
};

// There is too little to make something of. Files and disk are sound: it would come out like that again.
class NothingFound : public Error {
 public:
  using Error::Error;
};

// The user asked to stop (Ctrl-C). Not an error: everything written so far is valid and resumable, if the
// message does not say otherwise.
class Cancelled : public std::runtime_error {
 public:
  explicit Cancelled(const std::string& message = "stopped; run the same command again to go on")
      : std::runtime_error(message) {}
};

}  // namespace polarscan
