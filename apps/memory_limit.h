// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

namespace polarscan {

// Bytes that this program may use before the system kills it: the machine's memory and swap, or what its
// control group (container, service) has, if that is less. 0: not known.
std::uint64_t MemoryBytes();

// From now on an allocation beyond MemoryBytes() fails, here and in the programs that this one starts: a
// plain message instead of the kernel's kill. A lower limit that is set already stays.
void LimitMemory();

}  // namespace polarscan
