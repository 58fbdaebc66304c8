// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <nlohmann/json.hpp>
#include <string>

#include "core/progress.h"
#include "pipeline/stereo/shard.h"
#include "stereo/workspace.h"

namespace polarscan {

// Which maps of which views are there and were made from these inputs and options, with a hash of every map:
// a map that was changed or lost counts as not done. Kept in stereo/done.json; each shard writes a file of
// its own beside it (done-2-of-4.json) and reads those of all.
class DoneList {
 public:
  DoneList(const Workspace& workspace, std::uint64_t input_hash, Shard shard = {});
  bool IsDone(int view, const MapKind& kind) const;
  void Add(int view, const MapKind& kind);
  // Removes this shard's maps of this kind.
  void Remove(const MapKind& kind);
  // Forgets the maps of all other kinds, by whichever shard. For one that works alone.
  void KeepOnly(const MapKind& kind);
  // Until the other shards have made their maps of this kind. Throws Error if no new one comes for as long as
  // the shard is willing to wait, and Cancelled.
  void WaitForOthers(const MapKind& kind, Progress& progress);
  // Views whose maps of this kind are listed and there; what is in them is not looked at.
  int Count(const MapKind& kind) const;
  // For all views, here or in other shards.
  bool IsDone(const MapKind& kind) const;

 private:
  std::filesystem::path Folder() const { return workspace_.folder / "stereo"; }
  std::filesystem::path OwnFile() const;
  void Read();
  nlohmann::json MapsIn(const std::filesystem::path& file) const;
  void WriteOwn() const;
  std::string Key(int view, const MapKind& kind) const {
    return workspace_.views[std::size_t(view)].name + "." + ToString(kind);
  }
  std::string HashOf(int view, const MapKind& kind) const;

  const Workspace& workspace_;
  std::string input_;
  Shard shard_;
  nlohmann::json own_ = nlohmann::json::object(), all_ = nlohmann::json::object();
};

}  // namespace polarscan
