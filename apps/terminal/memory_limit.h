// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>

namespace polarscan {

// Bytes that this program may use before the system kills it: the machine's memory and swap, or what its
// control group (container, service) has, if that is less. 0: not known.
std::uint64_t MemoryBytes();

// What is freed goes back to the system at once if it was large (pictures, maps), instead of staying as gaps
// between others: several times less memory where maps come and go.
void ReturnFreedMemory();

// From now on an allocation beyond MemoryBytes() fails, here and in the programs that this one starts: a
// plain message instead of the kernel's kill. A lower limit that is set already stays.
void LimitMemory();

}  // namespace polarscan
