// SPDX-License-Identifier: Apache-2.0
#include "pipeline/views/view_store.h"

#include <algorithm>

#include "core/error.h"
#include "core/files/files.h"
#include "core/files/temporaries.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

json ReadState(const fs::path& path) {
  json state = json::object();
  try {
    if (fs::exists(path)) state = ReadJson(path);
  } catch (const Error&) {  // damaged: as if it were not there
  }
  if (!state.is_object() || !state.contains("views") || !state["views"].is_object())
    state = {{"views", json::object()}};
  return state;
}

}  // namespace

ViewStore::ViewStore(fs::path folder) : folder_(std::move(folder)) {
  CreateFolder(folder_);
  RemoveTemporaries(folder_, Below::kYes);
  state_ = ReadState(folder_ / "views.json");
  is_known_ = state_.contains("kind");
}

void ViewStore::Describe(const std::string& kind, bool polarized) {
  state_["kind"] = kind;
  state_["polarized"] = polarized;
}

std::optional<double> ViewStore::Scale(const std::string& key) const {
  if (state_.value("scale_key", json()) != key || !state_.contains("scale") || !state_["scale"].is_number())
    return std::nullopt;
  return state_["scale"].get<double>();
}

void ViewStore::SetScale(const std::string& key, double scale) {
  state_["scale_key"] = key;
  state_["scale"] = scale;
}

bool ViewStore::IsValid(const std::string& name, const std::string& hash) const {
  const json wanted = {{"hash", hash}, {"files", Hashes(name)}};
  return fs::exists(StokesPath(name)) && fs::exists(PicturePath(name)) &&
         state_["views"].value(name, json()) == wanted;
}

void ViewStore::Begin(const std::vector<std::string>& names) {
  for (const std::string& name : names) {
    if (state_["views"].contains(name)) continue;
    if (is_known_)
      for (const fs::path& path : {StokesPath(name), PicturePath(name), MaskPath(name)})
        RequireFree(
            path, [] { return false; }, "Move it away, or choose another folder with -o");
    state_["views"][name] = json::object();
  }
  Save();
}

void ViewStore::Record(const std::string& name, const std::string& hash) {
  const json record = {{"hash", hash}, {"files", Hashes(name)}};
  const std::lock_guard lock(mutex_);
  state_["views"][name] = record;
  Save();
}

void ViewStore::RemoveAllBut(const std::vector<std::string>& names) {
  std::vector<std::string> stale;
  for (const auto& [name, record] : state_["views"].items())
    if (std::ranges::find(names, name) == names.end()) stale.push_back(name);
  for (const std::string& name : stale) {
    for (const fs::path& path : {StokesPath(name), PicturePath(name), MaskPath(name)}) fs::remove(path);
    fs::remove_all(PicturesFolder(name));
    state_["views"].erase(name);
  }
  Save();
}

json ViewStore::Hashes(const std::string& name) const {
  json hashes = json::object();
  const auto add = [&](const fs::path& path) {
    hashes[fs::relative(path, folder_).string()] = ToHex(HashFile(path));
  };
  for (const fs::path& path : {StokesPath(name), PicturePath(name), MaskPath(name)})
    if (fs::exists(path)) add(path);
  if (fs::is_directory(PicturesFolder(name)))
    for (const fs::directory_entry& entry : fs::directory_iterator(PicturesFolder(name))) add(entry.path());
  return hashes;
}

void ViewStore::Save() const { WriteJson(folder_ / "views.json", state_); }

}  // namespace polarscan
