// SPDX-License-Identifier: Apache-2.0
#include "core/files/process.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <thread>

#include "core/error.h"
#include "core/files/descriptor.h"
#include "core/files/files.h"

namespace polarscan {
namespace {

using Clock = std::chrono::steady_clock;
constexpr std::chrono::milliseconds kPoll{20};           // at most; quick programs are asked sooner
constexpr auto kGrace = std::chrono::milliseconds(400);  // between the polite signal and the other one

bool IsExecutable(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(path, ignored) && access(path.c_str(), X_OK) == 0;
}

// The child's side of the fork: only async-signal-safe calls. Reports errno through `report` if it cannot
// start.
[[noreturn]] void Become(const char* file, char* const* argv, char* const* environment, const char* folder,
                         int log, int null, int report, pid_t parent) {
  setpgid(0, 0);
  prctl(PR_SET_PDEATHSIG, SIGKILL);  // a killed polarscan leaves no orphan computing on
  if (getppid() != parent) _exit(127);
  sigset_t none;
  sigemptyset(&none);
  sigprocmask(SIG_SETMASK, &none, nullptr);
  for (const int number : {SIGINT, SIGTERM, SIGPIPE, SIGHUP}) signal(number, SIG_DFL);
  if (chdir(folder) == 0 && dup2(null, STDIN_FILENO) >= 0 && dup2(log, STDOUT_FILENO) >= 0 &&
      dup2(log, STDERR_FILENO) >= 0)
    execve(file, argv, environment);
  const int reason = errno;
  if (write(report, &reason, sizeof reason) < 0) _exit(126);
  _exit(127);
}

// As the system wants them: pointers to the words, and a null one. They are valid as long as `words`.
std::vector<char*> Pointers(const std::vector<std::string>& words) {
  std::vector<char*> pointers;
  for (const std::string& word : words) pointers.push_back(const_cast<char*>(word.c_str()));
  pointers.push_back(nullptr);
  return pointers;
}

// `first`, and what we have ourselves of other names.
std::vector<std::string> Environment(const std::vector<std::string>& first) {
  std::vector<std::string> all = first;
  for (char** ours = environ; *ours; ++ours) {
    const std::string variable = *ours, name = variable.substr(0, variable.find('=') + 1);
    if (std::ranges::none_of(first, [&](const std::string& f) { return f.starts_with(name); }))
      all.push_back(variable);
  }
  return all;
}

pid_t Start(const std::vector<std::string>& argv, const std::vector<std::string>& environment,
            const std::filesystem::path& file, const std::filesystem::path& folder, int log) {
  const Descriptor null(open("/dev/null", O_RDONLY | O_CLOEXEC));
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0)
    throw Error("cannot start the program", file.string(), std::strerror(errno));
  Descriptor read_end(ends[0]), write_end(ends[1]);
  const std::vector<std::string> variables = Environment(environment);
  const std::vector<char*> arguments = Pointers(argv), variable_pointers = Pointers(variables);

  const pid_t parent = getpid();
  const pid_t pid = fork();
  if (pid == 0)
    Become(file.c_str(), arguments.data(), variable_pointers.data(), folder.c_str(), log, null.fd,
           write_end.fd, parent);
  if (pid < 0) throw Error("cannot start the program", file.string(), std::strerror(errno));
  setpgid(pid, pid);  // also here: whoever comes first, the group exists before anybody signals it
  write_end.Close();
  int reason = 0;
  if (read(read_end.fd, &reason, sizeof reason) == sizeof reason) {
    waitpid(pid, nullptr, 0);
    throw Error("cannot start the program", file.string(), std::strerror(reason));
  }
  return pid;
}

// Whether the process has ended; it stays a zombie, so that its id and its group's cannot be reused yet.
bool Ended(pid_t pid) {
  siginfo_t info{};
  return waitid(P_PID, id_t(pid), &info, WEXITED | WNOHANG | WNOWAIT) != 0 || info.si_pid == pid;
}

int Reap(pid_t pid) {
  int status = 0;
  while (waitpid(pid, &status, 0) < 0 && errno == EINTR) continue;
  return WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
}

int KillGroup(pid_t pid) {
  kill(-pid, SIGTERM);
  const auto until = Clock::now() + kGrace;
  while (!Ended(pid) && Clock::now() < until) std::this_thread::sleep_for(kPoll);
  kill(-pid, SIGKILL);  // its children too, even if the leader went quietly
  return Reap(pid);
}

}  // namespace

std::filesystem::path FindProgram(const std::string& name) {
  if (name.find('/') != std::string::npos) return std::filesystem::path(IsExecutable(name) ? name : "");
  const char* variable = std::getenv("PATH");
  std::string rest = variable ? variable : "/usr/local/bin:/usr/bin:/bin";
  while (!name.empty() && !rest.empty()) {
    const auto end = rest.find(':');
    const std::string folder = rest.substr(0, end);
    rest = end == std::string::npos ? "" : rest.substr(end + 1);
    const auto candidate = std::filesystem::path(folder.empty() ? "." : folder) / name;
    if (IsExecutable(candidate)) return candidate;
  }
  return {};
}

ProcessResult RunProcess(const std::vector<std::string>& argv, const std::filesystem::path& log,
                         Progress& progress, double timeout_s, const std::function<void()>& on_poll,
                         const std::filesystem::path& folder, const std::vector<std::string>& environment) {
  auto file = argv.empty() ? std::filesystem::path() : FindProgram(argv[0]);
  if (file.empty())
    throw Error("program not found", argv.empty() ? "(no name)" : argv[0], "Is it installed and in PATH?");
  file = std::filesystem::absolute(file);
  progress.Check();
  if (log.has_parent_path()) CreateFolder(log.parent_path());
  const Descriptor output(open(log.c_str(), O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC, 0666));
  if (output.fd < 0) throw Error("cannot write the log", log.string(), std::strerror(errno));

  const pid_t pid = Start(argv, environment, file, folder.empty() ? "." : folder, output.fd);
  const auto start = Clock::now();
  auto pause = std::chrono::milliseconds(1);
  try {
    while (!Ended(pid)) {
      if (timeout_s > 0 && std::chrono::duration<double>(Clock::now() - start).count() > timeout_s) {
        return {KillGroup(pid), true};
      }
      progress.Check();
      if (on_poll) on_poll();
      std::this_thread::sleep_for(pause);
      pause = std::min(2 * pause, kPoll);
    }
  } catch (...) {
    KillGroup(pid);
    throw;
  }
  return {Reap(pid), false};
}

}  // namespace polarscan
