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

// Where memory is limited (ulimit), starts the program anew with one thread in OpenBLAS, which comes with
// other libraries: each of its threads takes 128 MiB when it is loaded, and if it does not get them it tries
// for ever, also when the program ends. To be called first; returns where there is nothing to do.
void AvoidBlasThreads(char** argv);

// From now on an allocation beyond MemoryBytes() fails, here and in the programs that this one starts: a
// plain message instead of the kernel's kill. A lower limit that is set already stays.
void LimitMemory();

}  // namespace polarscan
