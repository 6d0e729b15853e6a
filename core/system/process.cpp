// SPDX-License-Identifier: BSD-3-Clause
#include "core/system/process.hpp"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fmt/format.h>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <thread>

#include "core/system/trace.hpp"

namespace orbitfuse {
namespace {

Result<pid_t> start(const std::vector<std::string>& command, const std::filesystem::path& log) {
  std::vector<char*> arguments;
  for (const std::string& argument : command)
    arguments.push_back(const_cast<char*>(argument.c_str()));
  arguments.push_back(nullptr);

  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, log.c_str(),
                                   O_WRONLY | O_CREAT | O_APPEND, 0644);
  posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
  posix_spawnattr_t attributes;  // own group: a terminal's Ctrl-C reaches us, we end the child
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGDEF);
  sigset_t usual;  // that we ignore SIGXFSZ is no business of a child's, which may not look
  sigemptyset(&usual);
  sigaddset(&usual, SIGXFSZ);
  posix_spawnattr_setsigdefault(&attributes, &usual);

  pid_t pid = 0;
  const int error =
      posix_spawnp(&pid, arguments[0], &files, &attributes, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  posix_spawnattr_destroy(&attributes);
  if (error != 0)
    return fail(ErrorKind::unavailable, command.front(),
                fmt::format("cannot be started: {}", std::strerror(error)),
                "install it, or put it on PATH");
  return pid;
}

}  // namespace

Result<int> run_process(const std::vector<std::string>& command, const std::filesystem::path& log,
                        const std::string& stage, const Progress& progress) {
  ORBITFUSE_TRY(progress.check(stage));
  const std::string_view program(command.front());
  const TraceSpan span(program.substr(program.rfind('/') + 1),
                       command.size() > 1 ? std::string_view(command[1]) : std::string_view());
  ORBITFUSE_ASSIGN(const pid_t pid, start(command, log));
  int status = 0;
  while (true) {
    const pid_t ended = waitpid(pid, &status, WNOHANG);
    if (ended == pid) break;
    if (ended < 0 && errno != EINTR)
      return fail(ErrorKind::unavailable, command.front(),
                  fmt::format("lost: {}", std::strerror(errno)), "run again");
    if (progress.cancelled()) {
      kill(-pid, SIGKILL);
      waitpid(pid, &status, 0);
      return tl::unexpected(progress.check(stage).error());
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace orbitfuse
