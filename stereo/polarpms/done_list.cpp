// SPDX-License-Identifier: Apache-2.0
#include "stereo/polarpms/done_list.h"

#include "core/files.h"

namespace polarscan {

namespace fs = std::filesystem;

DoneList::DoneList(const Workspace& workspace, std::uint64_t input_hash)
    : workspace_(workspace), input_(ToHex(input_hash)) {
  if (!fs::exists(Path())) return;
  const nlohmann::json stored = ReadJson(Path());
  if (stored.value("inputs", "") == input_) maps_ = stored.value("maps", nlohmann::json::object());
}

bool DoneList::IsDone(int view, const std::string& kind) const {
  const std::string key = Key(view, kind);
  if (!maps_.contains(key) || !fs::exists(workspace_.DepthPath(view, kind)) ||
      !fs::exists(workspace_.NormalPath(view, kind)))
    return false;
  return maps_[key] == HashOf(view, kind);
}

void DoneList::Add(int view, const std::string& kind) {
  maps_[Key(view, kind)] = HashOf(view, kind);
  WriteJson(Path(), {{"inputs", input_}, {"maps", maps_}});
}

void DoneList::Remove(int view, const std::string& kind) {
  maps_.erase(Key(view, kind));
  fs::remove(workspace_.DepthPath(view, kind));
  fs::remove(workspace_.NormalPath(view, kind));
}

std::string DoneList::HashOf(int view, const std::string& kind) const {
  return ToHex(HashFile(workspace_.DepthPath(view, kind), HashFile(workspace_.NormalPath(view, kind))));
}

}  // namespace polarscan
