// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "acquisition/host/host.h"
#include "core/progress.h"

namespace polarscan {

// What a recording needs: 24 frames/s of 5 MP in 12 bit, packed.
inline constexpr double kRecordingRate = 180e6;  // bytes/s

struct Disk {
  double free = 0;        // bytes that this user may fill
  double write_rate = 0;  // bytes/s that arrive on the disk; 0: not measured, too little is free
};

// Writes into `folder` for about a second, at most 256 MB, each 32 MB synced. The file has no name, so
// nothing is left whatever happens. Throws Error if the folder cannot be written, Cancelled when asked to
// stop.
Disk MeasureDisk(const std::filesystem::path& folder, const Progress& progress);

std::vector<HostCheck> CheckDisk(const std::filesystem::path& folder, const Disk& disk);

}  // namespace polarscan
