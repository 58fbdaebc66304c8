// SPDX-License-Identifier: Apache-2.0
// What an input is that open_folder.cpp opened, and several of them as one.
#include "acquisition/input/input.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "core/error.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

// The folders' own names, with a number where they are the same.
std::vector<std::string> LabelsOf(const std::vector<fs::path>& folders) {
  std::vector<std::string> labels;
  for (const fs::path& folder : folders) {
    const fs::path canonical = fs::weakly_canonical(folder);
    const std::string name = canonical.filename().string();
    const auto same = std::ranges::count_if(labels, [&](const std::string& label) { return label == name; });
    labels.push_back(same ? fmt::format("{}.{}", name, labels.size() + 1) : name);
  }
  return labels;
}

bool ShareNames(const std::vector<Input>& parts) {
  std::set<std::string> names;
  for (const Input& part : parts)
    for (const InputView& view : part.views)
      if (!names.insert(view.name).second) return true;
  return false;
}

// prefix: whether the views' names need the label.
void AddPart(const Input& part, const std::string& label, bool prefix, Input& all) {
  for (InputView view : part.views) {
    if (prefix) view.name = label + "-" + view.name;
    all.views.push_back(std::move(view));
  }
  for (const std::string& note : part.notes) all.notes.push_back(label + ": " + note);
  for (const std::string& warning : part.warnings) all.warnings.push_back(label + ": " + warning);
  if (part.known_model)
    all.warnings.push_back(
        fmt::format("the known poses in {} are not used: several folders are placed by their pictures",
                    part.known_model->string()));
}

void RequireDifferent(const std::vector<fs::path>& folders) {
  std::set<fs::path> different;
  for (const fs::path& folder : folders)
    if (!different.insert(fs::weakly_canonical(folder / "")).second)
      throw Error("this folder is given twice", folder.string(), "Give it once");
}

}  // namespace

std::string ToString(InputKind kind) {
  constexpr const char* kNames[] = {"mosaic", "angles", "stokes", "rgb-aop-dop", "photos"};
  return kNames[std::size_t(kind)];
}

Input OpenInputs(const std::vector<fs::path>& folders, const InputOptions& options, Progress& progress) {
  if (folders.size() == 1) return OpenInput(folders[0], options, progress);
  RequireDifferent(folders);
  Input all;
  for (const fs::path& folder : folders) all.parts.push_back(OpenInput(folder, options, progress));
  const Input& first = all.parts[0];
  all.folder = first.folder, all.kind = first.kind, all.width = first.width, all.height = first.height;
  const std::vector<std::string> labels = LabelsOf(folders);
  const bool prefix = ShareNames(all.parts);
  for (std::size_t p = 0; p < folders.size(); ++p) {
    const Input& part = all.parts[p];
    if (part.polarized() != first.polarized())
      throw Error("plain photos and pictures with polarization cannot be one scan",
                  fmt::format("{} and {}", folders[0].string(), folders[p].string()),
                  "Reconstruct them apart");
    AddPart(part, labels[p], prefix, all);
  }
  return all;
}

std::pair<const Input*, int> Input::Source(int view) const {
  for (const Input& part : parts) {
    if (view < int(part.views.size())) return {&part, view};
    view -= int(part.views.size());
  }
  return {this, view};
}

void TellNotes(const Input& input, Progress& progress) {
  for (const std::string& warning : input.warnings) progress.Warn(warning);
  for (const std::string& note : input.notes) input.polarized() ? progress.Info(note) : progress.Warn(note);
}

bool Input::damaged() const {
  return (session && !session->damage.empty()) || std::ranges::any_of(parts, &Input::damaged);
}

const MosaicCorrection& Input::correction() const {
  static const MosaicCorrection none;
  return calibration ? calibration->correction : none;
}

nlohmann::json Meaning(const Input& input) {
  if (!input.parts.empty()) {
    nlohmann::json parts = nlohmann::json::array();
    for (const Input& part : input.parts) parts.push_back(Meaning(part));
    return {{"kind", ToString(input.kind)}, {"parts", parts}};
  }
  nlohmann::json meaning = {
      {"calibration", input.calibration ? nlohmann::json(input.calibration->hash) : nlohmann::json()},
      {"kind", ToString(input.kind)},
      {"sensor", ToJson(input.sensor)},
      {"aop_sense", input.clockwise ? "clockwise" : "anticlockwise"},
      {"aop_scale", input.aop_scale}};
  if (input.angles != Input().angles) meaning["angles"] = input.angles;
  return meaning;
}

nlohmann::json ToJson(const Input& input) {
  nlohmann::json json = Meaning(input);
  json["folder"] = input.folder.string();
  json["views"] = input.views.size();
  json["masks"] =
      std::ranges::count_if(input.views, [](const InputView& view) { return view.mask.has_value(); });
  json["known_model"] = input.known_model ? nlohmann::json(input.known_model->string()) : nlohmann::json();
  json["notes"] = input.notes;
  json["warnings"] = input.warnings;
  return json;
}

}  // namespace polarscan
