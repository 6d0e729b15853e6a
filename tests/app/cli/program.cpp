// SPDX-License-Identifier: BSD-3-Clause
#include "tests/app/cli/program.hpp"

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <sstream>
#include <thread>

#include "core/system/file_io.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {
using nlohmann::json;

std::vector<json> Outcome::events() const {
  std::vector<json> list;
  std::istringstream lines(out);
  for (std::string line; std::getline(lines, line);) list.push_back(json::parse(line));
  return list;
}

json Outcome::result() const {
  const auto list = events();
  return list.empty() ? json() : list.back();
}

Outcome run_program(const std::vector<std::string>& command, const RunOptions& options) {
  const test::TempFolder temp;
  const auto out = temp.path() / "out", err = temp.path() / "err";
  const pid_t child = fork();
  if (child == 0) {
    const int out_fd = open(out.c_str(), O_WRONLY | O_CREAT, 0600);
    const int err_fd = open(err.c_str(), O_WRONLY | O_CREAT, 0600);
    const int null_fd = open("/dev/null", O_RDONLY);
    dup2(null_fd, 0);
    dup2(out_fd, 1);
    dup2(err_fd, 2);
    if (chdir(options.folder.c_str()) != 0) _exit(126);
    for (const std::string& variable : options.environment)
      putenv(const_cast<char*>(variable.c_str()));
    std::vector<char*> argv;
    for (const std::string& word : command) argv.push_back(const_cast<char*>(word.c_str()));
    argv.push_back(nullptr);
    execvp(argv[0], argv.data());
    _exit(127);
  }
  Outcome outcome;
  int status = 0;
  bool interrupted = options.interrupt_after.empty();
  while (waitpid(child, &status, interrupted ? 0 : WNOHANG) == 0) {
    const std::string text = read_file(err).value_or("") + read_file(out).value_or("");
    if (!interrupted && text.find(options.interrupt_after) != std::string::npos) {
      outcome.signalled = true;
      for (int i = 0; i < options.signals; ++i)
        if (kill(child, options.signal) != 0) outcome.signalled = false;
      interrupted = true;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  outcome.code = WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
  outcome.out = read_file(out).value_or("");
  outcome.err = read_file(err).value_or("");
  return outcome;
}

Outcome orbitfuse_program(const std::vector<std::string>& arguments, const RunOptions& options) {
  std::vector<std::string> command = {ORBITFUSE_BINARY_DIR "/app/orbitfuse"};
  command.insert(command.end(), arguments.begin(), arguments.end());
  return run_program(command, options);
}

}  // namespace orbitfuse
