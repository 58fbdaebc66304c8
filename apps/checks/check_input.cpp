// SPDX-License-Identifier: Apache-2.0
#include "apps/checks/check_input.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <map>

#include "acquisition/input/masks.h"
#include "core/error.h"
#include "pipeline/check_files.h"
#include "pipeline/stages.h"
#include "pipeline/views/views.h"
#include "stereo/sfm/known_poses.h"
#include "stereo/sfm/model/model.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

// needs: why reconstruct would not begin, though nothing is damaged.
struct Looked {
  std::vector<std::string> odd, damage, needs;

  template <class Look>
  void Try(Look&& look) {
    try {
      look();
    } catch (const Error& error) {
      damage.push_back(error.what());
    }
  }
};

// What only the options of a command can tell is assumed, so that the rest can be looked at.
Input Open(const fs::path& folder, InputOptions options, Looked& findings) {
  try {
    return OpenInput(folder, options);
  } catch (const Error& error) {
    findings.needs.push_back(error.what());
    const std::string layout = options.layout.empty() ? ToString(Layout()) : options.layout;
    for (const auto& [assumed, bits] : {std::pair(std::string(), 16), {layout, 0}, {layout, 16}}) {
      options.layout = assumed, options.bits = bits;
      try {
        return OpenInput(folder, options);
      } catch (const Error&) {
      }
    }
    throw;
  }
}

const char* Verdict(const Looked& findings) {
  if (!findings.damage.empty()) return "damaged";
  return findings.needs.empty() ? "sound" : "sound, but not enough for reconstruct, as the warnings say";
}

// Views that the known model has a pose for.
std::size_t CountPoses(const Input& input) {
  std::vector<std::string> names;
  for (const InputView& view : input.views) names.push_back(view.name);
  return CountKnownPoses(ReadSparseModel(*input.known_model), names);
}

// Returns the number of views with a mask: of its own or what is transparent in its picture.
std::size_t LookAtPictures(const Input& input, Looked& findings, Progress& progress) {
  std::size_t masks = 0;
  std::map<std::pair<int, int>, int> sizes;
  ViewFaults doubtful;
  progress.Begin("looking at the pictures", input.views.size());
  for (int i = 0; i < int(input.views.size()); ++i) {
    progress.Check();
    bool masked = input.views[std::size_t(i)].mask.has_value();
    findings.Try([&] {
      const LoadedView view = ReadView(input, i);
      masked |= !view.mask.empty();
      ++sizes[{view.pictures[0].width(), view.pictures[0].height()}];
      const PolarView light = MakeView(*input.Source(i).first, view, DemosaicOptions());
      doubtful.Add(view.name, DoubtsOf(light, view.mask));
    });
    masks += masked;
    progress.Advance();
  }
  progress.Check();
  for (const std::string& words : doubtful.Words(input)) findings.odd.push_back(words);
  for (const std::string& words : SamePictures(input, progress)) findings.odd.push_back(words);
  if (sizes.size() > 1 && input.kind != InputKind::kPhotos) {
    std::vector<std::string> words;
    for (const auto& [size, count] : sizes)
      words.push_back(fmt::format("{} of {}x{}", count, size.first, size.second));
    findings.odd.push_back(
        fmt::format("the pictures are of several sizes ({}): are some turned, or another camera's?",
                    fmt::join(words, ", ")));
  }
  findings.Try([&] {
    const std::vector<std::string> odd = CheckMasks(input, progress);
    findings.odd.insert(findings.odd.end(), odd.begin(), odd.end());
  });
  return masks;
}

}  // namespace

void CheckInputFolder(const fs::path& folder, const InputOptions& options, Context& context) {
  Looked findings;
  const Input input = Open(folder, options, findings);
  const bool assumed = !findings.needs.empty();
  findings.odd.insert(findings.odd.end(), input.warnings.begin(), input.warnings.end());
  const std::size_t masks = LookAtPictures(input, findings, context.progress);
  std::size_t poses = 0;
  if (input.known_model)
    findings.Try([&] {
      CheckModel(*input.known_model);
      poses = CountPoses(input);
      if (input.views.size() > 1) CheckKnownPoses(input, context.progress);
    });
  try {
    RequireTwoViews(input);
  } catch (const Error& error) {
    findings.needs.push_back(error.what());
  }
  std::ranges::sort(findings.damage);
  findings.damage.erase(std::unique(findings.damage.begin(), findings.damage.end()), findings.damage.end());
  for (const auto* list : {&findings.damage, &findings.needs, &findings.odd})
    for (const std::string& text : *list) context.progress.Warn(text);
  for (const std::string& note : input.notes) context.progress.Info(note);
  context.data_lost = !findings.damage.empty();
  context.not_ready = !findings.needs.empty();
  nlohmann::json result = ToJson(input);
  result.update({{"path", folder.string()},
                 {"form", result["kind"]},
                 {"kind", "input"},
                 {"width", input.width},
                 {"height", input.height},
                 {"masks", masks},
                 {"poses", poses},
                 {"sound", findings.damage.empty()},
                 {"needs", findings.needs},
                 {"odd", findings.odd},
                 {"damage", findings.damage}});
  context.Finish(result, fmt::format("input: {} of {}x{}, {}{}; masks for {}, poses for {}: {}",
                                     CountOf(input.views.size(), "view"), input.width, input.height,
                                     ToString(input.kind), assumed ? " (assumed)" : "", masks, poses,
                                     Verdict(findings)));
}

}  // namespace polarscan
