// SPDX-License-Identifier: BSD-3-Clause
#include "app/farm/stage_job.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <nlohmann/json.hpp>
#include <utility>

#include "core/nested_text.hpp"
#include "core/system/clock.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::farm {
namespace fs = std::filesystem;
using nlohmann::json;

namespace {

constexpr int exit_cannot_start = 126;
constexpr int exit_stopped = 130;  // docs/cli.md: a run that was asked to stop

/// In the child, after fork: system calls only.
[[noreturn]] void become(char* const* words, int events, int log, pid_t parent) {
  prctl(PR_SET_PDEATHSIG, SIGTERM);
  if (getppid() != parent) _exit(exit_stopped);  // it died before the line above
  setpgid(0, 0);                                 // Ctrl-C is the farm's, who asks it to stop
  const int none = open("/dev/null", O_RDONLY);
  dup2(none, STDIN_FILENO);
  dup2(events, STDOUT_FILENO);
  dup2(log, STDERR_FILENO);
  execv(words[0], words);
  _exit(exit_cannot_start);
}

/// The result line of the run that has just ended; null when it died without one.
json last_line(const fs::path& events) {
  auto text = read_file(events, max_text_bytes);
  if (!text || text->empty() || text->back() != '\n') return {};
  text->pop_back();
  const std::size_t begin = text->rfind('\n');
  const json line = parse_json(text->substr(begin == std::string::npos ? 0 : begin + 1));
  return line.is_object() && line.value("event", "") == "result" ? line : json();
}

int write_to(const fs::path& file, int how) {
  return open(file.c_str(), O_WRONLY | O_CREAT | O_CLOEXEC | how, 0644);
}

}  // namespace

std::string host_name() {
  char name[256] = "";
  gethostname(name, sizeof name - 1);
  return name;
}

Result<StageJob> StageJob::start(const FarmPlan& plan, const fs::path& out,
                                 const FarmSession& session, const std::string& stage) {
  StageJob job;
  job.stage_ = stage;
  job.before_ = read_outcome(out, session.name, stage);
  job.before_.state = JobState::running;
  job.before_.host = host_name();
  job.before_.cause.clear();
  ++job.before_.starts;
  ORBITFUSE_TRY(write_outcome(out, session.name, stage, job.before_));

  const StageNeeds needs = plan.needs_of(stage);
  std::vector<std::string> words = {
      plan.program, "run", session.folder, "--out",     (out / session.name).string(),
      "--stage",    stage, "--resume",     "--threads", std::to_string(needs.cores),
      "--json"};
  words.insert(words.end(), plan.options.begin(), plan.options.end());
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);

  job.events_ = records_of(out, session.name) / (stage + ".ndjson");
  // Of this start only: the last line must not be an earlier one's result.
  const int events = write_to(job.events_, O_TRUNC);
  const int log = write_to(records_of(out, session.name) / (stage + ".log"), O_APPEND);
  const int error = errno;
  const pid_t self = getpid();
  if (events >= 0 && log >= 0) {
    job.pid_ = fork();
    if (job.pid_ == 0) become(arguments.data(), events, log, self);
  }
  for (const int descriptor : {events, log})
    if (descriptor >= 0) close(descriptor);
  if (job.pid_ < 0)
    return fail(ErrorKind::device, (out / session.name).string(),
                fmt::format("{} cannot be started: {}", stage, std::strerror(error)),
                "check free space and processes, then: orbitfuse farm resume " + out.string());
  job.started_s_ = wall_seconds();
  return job;
}

StageJob::StageJob(StageJob&& other) noexcept { *this = std::move(other); }

StageJob& StageJob::operator=(StageJob&& other) noexcept {
  std::swap(pid_, other.pid_);
  std::swap(asked_to_stop_, other.asked_to_stop_);
  std::swap(started_s_, other.started_s_);
  std::swap(stage_, other.stage_);
  std::swap(events_, other.events_);
  std::swap(before_, other.before_);
  return *this;
}

StageJob::~StageJob() {
  if (pid_ <= 0) return;
  kill(pid_, SIGTERM);  // the farm itself ends: where it was asked before, it ends at once
  waitpid(pid_, nullptr, 0);
}

void StageJob::stop() {
  if (pid_ > 0 && !asked_to_stop_) kill(pid_, SIGTERM);
  asked_to_stop_ = true;
}

double StageJob::wall_s() const { return wall_seconds() - started_s_; }

std::optional<JobOutcome> StageJob::poll() {
  int status = 0;
  rusage usage{};
  const pid_t ended_pid = wait4(pid_, &status, WNOHANG, &usage);
  if (ended_pid == 0 || (ended_pid < 0 && errno == EINTR)) return std::nullopt;
  pid_ = -1;
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return ended(status, seconds(usage.ru_utime) + seconds(usage.ru_stime),
               static_cast<double>(usage.ru_maxrss) / 1024);
}

JobOutcome StageJob::ended(int status, double cpu_s, double memory_mb) const {
  JobOutcome outcome = before_;
  outcome.cpu_s += cpu_s;
  outcome.wall_s += wall_s();
  outcome.memory_mb = std::max(outcome.memory_mb, memory_mb);
  if (!WIFEXITED(status)) {
    const int signal = WTERMSIG(status);
    outcome.exit_code = 128 + signal;
    outcome.state = JobState::interrupted;
    outcome.cause = signal == SIGKILL
                        ? "killed (SIGKILL): out of memory, or by somebody's hand"
                        : fmt::format("died of signal {} ({})", signal, strsignal(signal));
    return outcome;
  }
  const int code = WEXITSTATUS(status);
  outcome.exit_code = code;
  const json result = last_line(events_);
  if (code == 0) {
    outcome.state = JobState::done;
    return outcome;
  }
  outcome.state = code == exit_stopped ? JobState::interrupted : JobState::failed;
  if (code == exit_cannot_start && result.is_null())
    outcome.cause = "the program is not there; install the same one on every node";
  else if (result.is_object() && result.contains("error"))
    outcome.cause = result["error"].value("message", std::string("no message"));
  else
    outcome.cause = fmt::format("ended with code {} without a word", code);
  return outcome;
}

}  // namespace orbitfuse::farm
