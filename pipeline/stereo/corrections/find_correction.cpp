// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stereo/corrections/find_correction.h"

#include <fmt/format.h>

#include <chrono>
#include <thread>

#include "core/error.h"
#include "core/files/files.h"
#include "pipeline/stereo/corrections/polarization_fit.h"
#include "pipeline/stereo/schedules/multilevel.h"
#include "pipeline/stereo/stereo.h"
#include "stereo/dense/crop.h"

namespace polarscan {
namespace {

// question(workspace, coarse maps' kind, how often halved, progress), asked when they are there for all views.
template <class Question>
auto AskCoarsest(const Workspace& workspace, const StereoOptions& options, std::uint64_t hash,
                 const Shard& shard, Progress& progress, Question&& question) {
  StepRunner steps(CutToObject(workspace, options), options, hash, shard, progress);
  const CoarseMaps coarse = RunCoarsest(steps);
  return question(steps.workspace(), coarse.kind, coarse.halvings, progress);
}

// By maps that are made without polarization; a turn that those find is made better once by maps that are made with
// it.
PolarizationCorrection WhereThereIsDoubt(const Workspace& as_given, const StereoOptions& options,
                                         std::uint64_t inputs, Progress& progress) {
  StereoOptions without = options;
  without.polarization = false;
  Workspace corrected = as_given;
  corrected.correction =
      AskCoarsest(as_given, without, StereoInputHash(as_given, without), Shard(), progress, FitPolarization)
          .correction;
  if (corrected.correction.turn_deg == 0) return corrected.correction;
  return AskCoarsest(corrected, options, WithCorrection(inputs, corrected.correction), Shard(), progress,
                     RefinedTurn);
}

// Until the first shard has found it. Throws Error if it does not for as long as the shard is willing to wait.
PolarizationCorrection WaitForCorrection(const Workspace& as_given, std::uint64_t inputs, const Shard& shard,
                                         Progress& progress) {
  const auto start = std::chrono::steady_clock::now();
  while (true) {
    if (const auto known = KnownCorrection(as_given, inputs)) return *known;
    progress.Check();
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    if (std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() > shard.patience_s)
      throw Error(
          fmt::format("the first shard has not looked at the polarization for {:.0f} s", shard.patience_s),
          as_given.folder.string(), "Start all shards, with the same options; then run this one again");
  }
}

}  // namespace

std::optional<PolarizationCorrection> KnownCorrection(const Workspace& as_given, std::uint64_t inputs) {
  const auto found = ReadCorrection(as_given);
  if (!found || found->inputs != ToHex(inputs)) return std::nullopt;
  return found->correction;
}

std::uint64_t WithCorrection(std::uint64_t inputs, const PolarizationCorrection& c) {
  if (c == PolarizationCorrection()) return inputs;
  return Hash(fmt::format("{} {} {} {}", c.turn_deg, c.mirrored, c.bias_s1, c.bias_s2), inputs);
}

PolarizationCorrection FindCorrection(const Workspace& as_given, const StereoOptions& options,
                                      std::uint64_t inputs, const Shard& shard, Progress& progress) {
  if (options.schedule != "checkerboard" || !options.fit_polarization || !options.polarization ||
      !as_given.polarized || options.rounds == 0) {
    RemoveCorrection(as_given);  // of an earlier run: these maps are made without
    return {};
  }
  if (const auto known = KnownCorrection(as_given, inputs)) return *known;
  if (shard.index > 0) {
    AskCoarsest(as_given, options, inputs, shard, progress, [](const auto&...) { return 0; });
    return WaitForCorrection(as_given, inputs, shard, progress);
  }
  const bool doubtful = AskCoarsest(as_given, options, inputs, shard, progress, FitPolarization).doubtful;
  const PolarizationCorrection correction =
      doubtful ? WhereThereIsDoubt(as_given, options, inputs, progress) : PolarizationCorrection();
  WriteCorrection(as_given, {correction, ToHex(inputs)});
  return correction;
}

}  // namespace polarscan
