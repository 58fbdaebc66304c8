// SPDX-License-Identifier: Apache-2.0
#include "acquisition/host/disk.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <stdlib.h>
#include <sys/statvfs.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>

#include "core/files/descriptor.h"
#include "core/files/files.h"
#include "core/random.h"

namespace polarscan {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kBlock = 32 << 20, kMostWritten = 256 << 20;  // bytes
constexpr double kMeasure_s = 1, kShortest_s = 60;                  // of measuring; of a recording

// Random: some file systems compress, and leave zeros out.
std::vector<std::uint64_t> Noise(std::size_t bytes) {
  std::vector<std::uint64_t> noise(bytes / sizeof(std::uint64_t));
  Random random(1);
  for (std::uint64_t& word : noise) word = random.Next64();
  return noise;
}

Descriptor NamelessFile(const fs::path& folder) {
  std::string name = (folder / ".polarscan-doctor-XXXXXX").string();
  Descriptor file(::mkostemp(name.data(), O_CLOEXEC));
  if (file.fd < 0) ThrowSystemError("cannot write", folder);
  ::unlink(name.c_str());
  return file;
}

void WriteBlock(const Descriptor& file, const std::vector<std::uint64_t>& block, const fs::path& folder) {
  const char* bytes = reinterpret_cast<const char*>(block.data());
  for (std::size_t done = 0; done < kBlock;) {
    const ssize_t written = ::write(file.fd, bytes + done, kBlock - done);
    if (written < 0 && errno != EINTR) ThrowSystemError("cannot write", folder);
    if (written > 0) done += std::size_t(written);
  }
  if (::fdatasync(file.fd) != 0) ThrowSystemError("cannot write", folder);
}

double MeasureWriteRate(const fs::path& folder, const Progress& progress) {
  const std::vector<std::uint64_t> block = Noise(kBlock);
  const Descriptor file = NamelessFile(folder);
  const auto began = std::chrono::steady_clock::now();
  double seconds = 0;
  std::size_t written = 0;
  while (seconds < kMeasure_s && written < kMostWritten) {
    progress.Check();
    WriteBlock(file, block, folder);
    written += kBlock;
    seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count();
  }
  return double(written) / seconds;
}

HostCheck CheckFree(const fs::path& folder, double free) {
  const double needed = kShortest_s * kRecordingRate;
  HostCheck check{
      "disk, free", CheckState::kGood,
      fmt::format("{:.0f} GB: {:.0f} min at 24 frames/s of 5 MP", free / 1e9, free / kRecordingRate / 60),
      fmt::format("{:.0f} GB (a minute)", needed / 1e9), ""};
  if (free < needed) {
    check.state = CheckState::kWarning;
    check.fix = fmt::format("record on another disk than that of {}, or free some space", folder.string());
  }
  return check;
}

}  // namespace

Disk MeasureDisk(const fs::path& folder, const Progress& progress) {
  struct statvfs status {};
  if (::statvfs(folder.c_str(), &status) != 0) ThrowSystemError("cannot look into the folder", folder);
  Disk disk{double(status.f_bavail) * double(status.f_frsize), 0};
  if (disk.free > 2 * double(kMostWritten)) disk.write_rate = MeasureWriteRate(folder, progress);
  return disk;
}

std::vector<HostCheck> CheckDisk(const fs::path& folder, const Disk& disk) {
  HostCheck rate{"disk, writing", CheckState::kGood, fmt::format("{:.0f} MB/s", disk.write_rate / 1e6),
                 fmt::format("{:.0f} MB/s, for 24 frames/s of 5 MP", kRecordingRate / 1e6), ""};
  if (disk.write_rate == 0) {
    rate.state = CheckState::kNotApplicable;
    rate.measured = "not measured, too little is free";
  } else if (disk.write_rate < kRecordingRate) {
    rate.state = CheckState::kWarning;
    rate.fix = "polarscan doctor --folder FOLDER   (on a faster disk), or record fewer frames a second";
  }
  return {CheckFree(folder, disk.free), rate};
}

}  // namespace polarscan
