// SPDX-License-Identifier: Apache-2.0
#include "program.h"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <stdexcept>
#include <thread>

#include "core/files/files.h"
#include "core/files/process.h"

namespace polarscan::test {
namespace fs = std::filesystem;
namespace {

// In the child: never returns.
[[noreturn]] void Execute(std::vector<std::string> argv,
                          const std::map<std::string, std::string>& environment, const fs::path& out,
                          const fs::path& err) {
  for (const auto& [name, value] : environment) ::setenv(name.c_str(), value.c_str(), 1);
  ::dup2(::open("/dev/null", O_RDONLY), STDIN_FILENO);
  ::dup2(::open(out.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666), STDOUT_FILENO);
  ::dup2(::open(err.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0666), STDERR_FILENO);
  std::vector<char*> pointers;
  for (std::string& argument : argv) pointers.push_back(argument.data());
  pointers.push_back(nullptr);
  ::execvp(pointers[0], pointers.data());
  ::_exit(127);
}

}  // namespace

TemporaryFolder::TemporaryFolder() {
  std::string name = (fs::temp_directory_path() / "polarscan-test-XXXXXX").string();
  if (!::mkdtemp(name.data())) throw std::runtime_error("cannot make a folder below " + name);
  path_ = name;
}

TemporaryFolder::~TemporaryFolder() {
  std::error_code ignored;  // a test that mounts or locks something here has failed already
  fs::remove_all(path_, ignored);
}

Process::Process(const std::vector<std::string>& argv,
                 const std::map<std::string, std::string>& environment) {
  pid_ = ::fork();
  if (pid_ < 0) throw std::runtime_error("cannot fork");
  if (pid_ == 0) Execute(argv, environment, folder_ / "out", folder_ / "err");
}

Process::~Process() {
  if (Running()) Signal(SIGKILL);
  if (!ended_) ::waitpid(pid_, &status_, 0);
}

void Process::Signal(int signal) { ::kill(pid_, signal); }

bool Process::Running() {
  if (!ended_) ended_ = ::waitpid(pid_, &status_, WNOHANG) == pid_;
  return !ended_;
}

Outcome Process::Wait(double limit_s) {
  const auto begin = std::chrono::steady_clock::now();
  while (Running()) {
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    if (std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count() > limit_s)
      Signal(SIGKILL);
  }
  const int code = WIFSIGNALED(status_) ? 128 + WTERMSIG(status_) : WEXITSTATUS(status_);
  return {code, ReadFile(folder_ / "out"), ReadFile(folder_ / "err")};
}

std::vector<std::string> Polarscan(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), POLARSCAN_PROGRAM);
  return arguments;
}

Outcome RunPolarscan(const std::vector<std::string>& arguments,
                     const std::map<std::string, std::string>& environment) {
  return Process(Polarscan(arguments), environment).Wait();
}

bool HasProgram(const std::string& name) { return !FindProgram(name).empty(); }

std::map<std::string, std::string> Contents(const fs::path& folder) {
  std::map<std::string, std::string> contents;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(folder))
    if (entry.is_regular_file() && !entry.path().filename().string().starts_with('.'))
      contents[entry.path().lexically_relative(folder).string()] = ReadFile(entry.path());
  return contents;
}

}  // namespace polarscan::test
