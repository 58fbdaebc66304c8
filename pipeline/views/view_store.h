// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <mutex>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

namespace polarscan {

// The folder that MakeStokesViews writes (see views.h) and its views.json, which says what is done. Record
// may be called from any thread; every change is on disk when the call returns.
class ViewStore {
 public:
  // Opens or creates the folder. A damaged views.json counts as none: everything is then made again.
  // Half-written files of a killed run are removed.
  explicit ViewStore(std::filesystem::path folder);

  std::filesystem::path StokesPath(const std::string& name) const { return folder_ / (name + ".tif"); }
  std::filesystem::path PicturePath(const std::string& name) const { return folder_ / (name + ".png"); }
  std::filesystem::path MaskPath(const std::string& name) const {
    return folder_ / "masks" / (name + ".png");
  }

  // The folder of pictures for people, if they are asked for (view_pictures.h).
  std::filesystem::path PicturesFolder(const std::string& name) const { return folder_ / "pictures" / name; }

  void Describe(const std::string& kind, bool polarized);
  // The scale that was measured under this key, if that is the one kept.
  std::optional<double> Scale(const std::string& key) const;
  void SetScale(const std::string& key, double scale);

  // Whether the view was made under this hash and its files still have their contents.
  bool IsValid(const std::string& name, const std::string& hash) const;
  // These views are going to be written. Throws Error if files lie in their place that are not the folder's
  // own.
  void Begin(const std::vector<std::string>& names);
  // The view's files are written and complete.
  void Record(const std::string& name, const std::string& hash);
  // Forgets the other views and removes their files.
  void RemoveAllBut(const std::vector<std::string>& names);

 private:
  nlohmann::json Hashes(const std::string& name) const;
  void Save() const;

  std::filesystem::path folder_;
  nlohmann::json state_;
  bool is_known_ = false;  // views.json was there and whole: a file of none of its views is not ours
  std::mutex mutex_;
};

}  // namespace polarscan
