// SPDX-License-Identifier: Apache-2.0
#include "acquisition/session/mapped_file.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include "core/files/descriptor.h"
#include "core/files/files.h"

namespace polarscan {

MappedFile::MappedFile(const std::filesystem::path& path) {
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  struct stat info {};
  if (file.fd < 0 || ::fstat(file.fd, &info) != 0) ThrowSystemError("cannot read the file", path);
  void* data = nullptr;
  if (info.st_size > 0) data = ::mmap(nullptr, std::size_t(info.st_size), PROT_READ, MAP_SHARED, file.fd, 0);
  if (data == MAP_FAILED) ThrowSystemError("cannot read the file", path);
  if (data) bytes_ = {static_cast<const char*>(data), std::size_t(info.st_size)};
}

MappedFile::~MappedFile() {
  if (!bytes_.empty()) ::munmap(const_cast<char*>(bytes_.data()), bytes_.size());
}

}  // namespace polarscan
