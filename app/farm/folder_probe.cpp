// SPDX-License-Identifier: BSD-3-Clause
#include "app/farm/folder_probe.hpp"

#include <fmt/format.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "core/system/clock.hpp"

namespace orbitfuse::farm {

Status answers(const std::filesystem::path& folder, double within_s) {
  return answers(folder, within_s, [&] {
    struct stat ignored {};
    (void)stat(folder.c_str(), &ignored);
  });
}

Status answers(const std::filesystem::path& folder, double within_s,
               const std::function<void()>& ask) {
  const pid_t child = fork();
  if (child == 0) {
    ask();
    _exit(0);
  }
  if (child < 0) return {};  // too many processes: whoever opens the folder will say more
  const double begin_s = wall_seconds();
  while (wall_seconds() - begin_s < within_s) {
    if (waitpid(child, nullptr, WNOHANG) != 0) return {};
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  kill(child, SIGKILL);
  (void)waitpid(child, nullptr, WNOHANG);  // in vain while the file system holds it
  return fail(ErrorKind::device, folder.string(),
              fmt::format("its file system does not answer within {:.0f} s", within_s),
              "mount it again, or choose another folder with --out; nothing was changed");
}

}  // namespace orbitfuse::farm
