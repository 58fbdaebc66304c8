// SPDX-License-Identifier: Apache-2.0
// The power goes at any moment: bytes that were written but not synced are gone, torn or garbled. The way of
// SQLite's crash tests: a disk that remembers what it was told, and every disk that can be left of it.
#include <algorithm>
#include <map>

#include "acquisition/session/session_repair.h"
#include "acquisition/session/session_writer.h"
#include "session_helpers.h"

namespace polarscan::test {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kSector = 512;

struct Operation {
  std::string file;  // name in segments/
  std::string bytes;
  bool sync = false;
  std::size_t frames = 0, acknowledged = 0;  // after it: appended and synced ones
};

// Remembers, and writes nothing.
struct Disk {
  std::vector<Operation> log;
  std::size_t frames = 0, acknowledged = 0;
  void Add(Operation operation) {
    operation.frames = frames, operation.acknowledged = acknowledged;
    log.push_back(std::move(operation));
  }
};

class LoggedFile : public AppendFile {
 public:
  LoggedFile(Disk& disk, const fs::path& path) : disk_(disk), name_(path.filename().string()) {
    disk_.Add({name_, "", true});  // the name itself is synced
  }
  void Append(std::string_view head, std::string_view body) override {
    ++disk_.frames;
    disk_.Add({name_, std::string(head) + std::string(body)});
  }
  void Sync() override {
    disk_.acknowledged = disk_.frames;
    disk_.Add({name_, "", true});
  }
  void Truncate(std::uint64_t) override {}

 private:
  Disk& disk_;
  std::string name_;
};

struct Part {
  std::string safe, unsynced;
};

// What the files hold after the first `count` operations.
std::map<std::string, Part> FilesAfter(const Disk& disk, std::size_t count) {
  std::map<std::string, Part> files;
  for (std::size_t i = 0; i < count; ++i) {
    Part& part = files[disk.log[i].file];
    part.unsynced += disk.log[i].bytes;
    if (disk.log[i].sync) part.safe += part.unsynced, part.unsynced.clear();
  }
  return files;
}

enum class Loss { kAll, kNone, kTorn, kSectorsZero, kSectorsOld };

// A disk keeps what was synced; of the rest it keeps what it likes.
std::string After(Loss loss, std::string bytes, Random& random) {
  if (loss == Loss::kAll) return "";
  if (loss == Loss::kTorn) return bytes.substr(0, random.Below(std::uint32_t(bytes.size() + 1)));
  if (loss == Loss::kNone) return bytes;
  for (std::size_t at = 0; at < bytes.size(); at += kSector)
    if (random.Below(2))
      for (std::size_t i = at; i < std::min(bytes.size(), at + kSector); ++i)
        bytes[i] = loss == Loss::kSectorsZero ? '\0' : char(random.Below(256));
  return bytes;
}

class PowerLoss : public SessionFolder {
 protected:
  // 40 frames in segments of some, synced now and then.
  void Record() {
    SessionWriter writer(session(), SomeInfo(), 5000,
                         [&](const fs::path& path) { return std::make_unique<LoggedFile>(disk_, path); });
    for (std::uint64_t i = 0; i < 40; ++i) {
      writer.Append(NumberedFrame(i, 96 + 12 * (i % 70)));
      if (i % 4 == 3) writer.Sync();
    }
  }
  Disk disk_;
};

TEST_F(PowerLoss, WhateverTheDiskForgetsEveryAcknowledgedFrameIsThereAndNoneIsInvented) {
  Record();
  Random random(5);
  for (std::size_t count = 0; count <= disk_.log.size(); ++count)
    for (const Loss loss : {Loss::kAll, Loss::kNone, Loss::kTorn, Loss::kSectorsZero, Loss::kSectorsOld}) {
      fs::remove_all(session() / "segments");
      fs::create_directories(session() / "segments");
      std::size_t left_over = 0;
      for (const auto& [name, part] : FilesAfter(disk_, count)) {
        const std::string rest = After(loss, part.unsynced, random);
        left_over += rest.size();
        Overwrite(session() / "segments" / name, part.safe + rest);
      }
      const std::size_t acknowledged = count ? disk_.log[count - 1].acknowledged : 0;
      const std::size_t appended = count ? disk_.log[count - 1].frames : 0;
      const Session read = OpenSession(session(), Verify::kPayloads);
      ASSERT_GE(read.frames.size(), acknowledged) << "operation " << count;
      ASSERT_LE(read.frames.size(), appended);
      for (std::size_t i = 0; i < read.frames.size(); ++i) {
        const Frame frame = ReadFrame(read, i);
        const std::uint64_t number = frame.info.sequence;
        ASSERT_TRUE(i >= acknowledged || number == i);
        ASSERT_LT(number, appended);
        ASSERT_EQ(frame.payload, NumberedFrame(number, 96 + 12 * (number % 70)).payload);
      }
      const bool all = read.frames.size() == appended;
      ASSERT_TRUE(all || loss != Loss::kNone);
      const bool garbled = !all && left_over > 0 && loss != Loss::kTorn;
      const bool said = !read.damage.empty() || !read.unfinished.empty();
      ASSERT_TRUE(said || !garbled) << "nothing is said about what is garbled";
      Session repaired = read;
      RepairSession(repaired);
      ASSERT_EQ(repaired.frames.size(), read.frames.size());
      ASSERT_TRUE(repaired.unfinished.empty());
      SessionInfo open = repaired.info;  // for the next round
      open.closed = false;
      WriteSessionInfo(session(), open);
    }
}

}  // namespace
}  // namespace polarscan::test
