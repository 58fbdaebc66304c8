// SPDX-License-Identifier: Apache-2.0
#include "pipeline/stereo/done_list.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "core/files/files.h"

namespace polarscan {

namespace fs = std::filesystem;
using nlohmann::json;

DoneList::DoneList(const Workspace& workspace, std::uint64_t input_hash, Shard shard)
    : workspace_(workspace), input_(ToHex(input_hash)), shard_(shard) {
  Read();
  own_ = shard_.count == 1 ? all_ : MapsIn(OwnFile());
}

fs::path DoneList::OwnFile() const {
  if (shard_.count == 1) return Folder() / "done.json";
  return Folder() / fmt::format("done-{}-of-{}.json", shard_.index + 1, shard_.count);
}

void DoneList::Read() {
  if (!fs::is_directory(Folder())) return;
  for (const fs::directory_entry& entry : fs::directory_iterator(Folder())) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with("done") || entry.path().extension() != ".json") continue;
    if (entry.path() != OwnFile() || own_.empty()) all_.update(MapsIn(entry.path()));
  }
}

json DoneList::MapsIn(const fs::path& file) const {
  if (!fs::exists(file)) return json::object();
  const json stored = ReadJson(file);
  return stored.value("inputs", "") == input_ ? stored.value("maps", json::object()) : json::object();
}

bool DoneList::IsDone(int view, const MapKind& kind) const {
  const std::string key = Key(view, kind);
  if (!all_.contains(key) || !fs::exists(workspace_.DepthPath(view, kind)) ||
      !fs::exists(workspace_.NormalPath(view, kind)))
    return false;
  return all_[key] == HashOf(view, kind);
}

bool DoneList::IsDone(const MapKind& kind) const {
  for (int view = 0; view < int(workspace_.views.size()); ++view)
    if (!IsDone(view, kind)) return false;
  return true;
}

void DoneList::Add(int view, const MapKind& kind) {
  const std::string key = Key(view, kind);
  own_[key] = all_[key] = HashOf(view, kind);
  WriteOwn();
}

void DoneList::WriteOwn() const { WriteJson(OwnFile(), {{"inputs", input_}, {"maps", own_}}); }

void DoneList::KeepOnly(const MapKind& kind) {
  json kept = json::object();
  for (int view = 0; view < int(workspace_.views.size()); ++view)
    if (const std::string key = Key(view, kind); all_.contains(key)) kept[key] = all_[key];
  own_ = all_ = kept;
  WriteOwn();
}

void DoneList::Remove(const MapKind& kind) {
  for (int view = shard_.index; view < int(workspace_.views.size()); view += shard_.count) {
    own_.erase(Key(view, kind)), all_.erase(Key(view, kind));
    fs::remove(workspace_.DepthPath(view, kind));
    fs::remove(workspace_.NormalPath(view, kind));
  }
}

int DoneList::Count(const MapKind& kind) const {
  int count = 0;
  for (int view = 0; view < int(workspace_.views.size()); ++view)
    count += all_.contains(Key(view, kind)) && fs::exists(workspace_.NormalPath(view, kind));
  return count;
}

void DoneList::WaitForOthers(const MapKind& kind, Progress& progress) {
  using Clock = std::chrono::steady_clock;
  const int wanted = int(workspace_.views.size());
  int there = Count(kind);
  auto last_news = Clock::now();
  std::chrono::milliseconds pause(10);  // soon at first, then less often: somebody serves these files
  while (there < wanted) {
    progress.Check();
    std::this_thread::sleep_for(pause);
    pause = std::min(2 * pause, std::chrono::milliseconds(320));
    Read();
    const int now = Count(kind);
    if (now != there) last_news = Clock::now();
    there = now;
    if (std::chrono::duration<double>(Clock::now() - last_news).count() > shard_.patience_s)
      throw Error(fmt::format("the maps of {} views by other shards are missing, and none came for {:.0f} s",
                              wanted - there, shard_.patience_s),
                  Folder().string(),
                  "Start all shards, with the same options; then run this one again, it goes on from here");
  }
}

std::string DoneList::HashOf(int view, const MapKind& kind) const {
  return ToHex(HashFile(workspace_.DepthPath(view, kind), HashFile(workspace_.NormalPath(view, kind))));
}

}  // namespace polarscan
