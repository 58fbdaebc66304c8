// SPDX-License-Identifier: Apache-2.0
#include "core/files/append_file.h"

#include <fcntl.h>
#include <sys/uio.h>
#include <unistd.h>

#include <cerrno>

#include "core/files/descriptor.h"
#include "core/files/files.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

class PosixAppendFile : public AppendFile {
 public:
  explicit PosixAppendFile(const fs::path& path)
      : path_(path), file_(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0666)) {
    if (file_.fd < 0) ThrowSystemError("cannot make the file", path);
    SyncFolder(path.parent_path());
  }

  void Append(std::string_view head, std::string_view body) override {
    while (!head.empty() || !body.empty()) {
      const iovec parts[] = {{const_cast<char*>(head.data()), head.size()},
                             {const_cast<char*>(body.data()), body.size()}};
      const ssize_t n = ::writev(file_.fd, parts, 2);
      if (n < 0 && errno != EINTR) ThrowSystemError("cannot write the file", path_);
      if (n <= 0) continue;
      const std::size_t of_head = std::min(head.size(), std::size_t(n));
      head.remove_prefix(of_head);
      body.remove_prefix(std::size_t(n) - of_head);
    }
  }
  void Sync() override {
    if (::fdatasync(file_.fd) != 0) ThrowSystemError("cannot write to the disk", path_);
  }
  void Truncate(std::uint64_t bytes) override {
    if (::ftruncate(file_.fd, off_t(bytes)) != 0) ThrowSystemError("cannot cut the file back", path_);
  }

 private:
  fs::path path_;
  Descriptor file_;
};

}  // namespace

std::unique_ptr<AppendFile> CreateAppendFile(const fs::path& path) {
  return std::make_unique<PosixAppendFile>(path);
}

}  // namespace polarscan
