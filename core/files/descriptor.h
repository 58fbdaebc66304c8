// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <unistd.h>

#include <utility>

namespace polarscan {

// A file descriptor that closes itself; -1 is none.
struct Descriptor {
  int fd = -1;

  explicit Descriptor(int descriptor) : fd(descriptor) {}
  Descriptor(Descriptor&& other) noexcept : fd(std::exchange(other.fd, -1)) {}
  Descriptor& operator=(Descriptor&&) = delete;
  ~Descriptor() { Close(); }

  void Close() {
    if (fd >= 0) ::close(fd);
    fd = -1;
  }
};

}  // namespace polarscan
