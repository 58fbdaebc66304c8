// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <nlohmann/json.hpp>
#include <string>

#include "stereo/workspace.h"

namespace polarscan {

// Which maps of which views are there and were made from these inputs and options: stereo/done.json, with a
// hash of every map. A map that was changed or lost counts as not done.
class DoneList {
 public:
  DoneList(const Workspace& workspace, std::uint64_t input_hash);
  bool IsDone(int view, const std::string& kind) const;
  void Add(int view, const std::string& kind);
  // Removes the maps of this kind.
  void Remove(int view, const std::string& kind);

 private:
  std::filesystem::path Path() const { return workspace_.folder / "stereo/done.json"; }
  std::string Key(int view, const std::string& kind) const {
    return workspace_.views[std::size_t(view)].name + "." + kind;
  }
  std::string HashOf(int view, const std::string& kind) const;

  const Workspace& workspace_;
  std::string input_;
  nlohmann::json maps_ = nlohmann::json::object();
};

}  // namespace polarscan
