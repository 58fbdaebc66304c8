// SPDX-License-Identifier: Apache-2.0
#include "core/append_file.h"

#include <fcntl.h>
#include <sys/uio.h>
#include <unistd.h>

#include <cerrno>

#include "core/files.h"

namespace polarscan {
namespace {

namespace fs = std::filesystem;

void SyncFolder(const fs::path& folder) {
  const int fd = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  const bool good = fd >= 0 && ::fsync(fd) == 0;
  const int reason = errno;
  if (fd >= 0) ::close(fd);
  errno = reason;
  if (!good) ThrowSystemError("cannot write to the disk", folder);
}

class PosixAppendFile : public AppendFile {
 public:
  explicit PosixAppendFile(const fs::path& path)
      : path_(path), fd_(::open(path.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_APPEND | O_CLOEXEC, 0666)) {
    if (fd_ < 0) ThrowSystemError("cannot make the file", path);
    SyncFolder(path.parent_path());
  }
  PosixAppendFile(const PosixAppendFile&) = delete;
  PosixAppendFile& operator=(const PosixAppendFile&) = delete;
  ~PosixAppendFile() override { ::close(fd_); }

  void Append(std::string_view head, std::string_view body) override {
    while (!head.empty() || !body.empty()) {
      const iovec parts[] = {{const_cast<char*>(head.data()), head.size()},
                             {const_cast<char*>(body.data()), body.size()}};
      const ssize_t n = ::writev(fd_, parts, 2);
      if (n < 0 && errno != EINTR) ThrowSystemError("cannot write the file", path_);
      if (n <= 0) continue;
      const std::size_t of_head = std::min(head.size(), std::size_t(n));
      head.remove_prefix(of_head);
      body.remove_prefix(std::size_t(n) - of_head);
    }
  }
  void Sync() override {
    if (::fdatasync(fd_) != 0) ThrowSystemError("cannot write to the disk", path_);
  }
  void Truncate(std::uint64_t bytes) override {
    if (::ftruncate(fd_, off_t(bytes)) != 0) ThrowSystemError("cannot cut the file back", path_);
  }

 private:
  fs::path path_;
  int fd_;
};

}  // namespace

std::unique_ptr<AppendFile> CreateAppendFile(const fs::path& path) {
  return std::make_unique<PosixAppendFile>(path);
}

}  // namespace polarscan
