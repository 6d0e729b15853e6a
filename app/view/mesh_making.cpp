// SPDX-License-Identifier: BSD-3-Clause
#include "app/view/mesh_making.hpp"

#include <chrono>

namespace orbitfuse::view {
namespace {

/// Between two of its views; who makes a film leaves no pause, and the surface comes all the same.
constexpr std::chrono::milliseconds longest_wait{1000};

}  // namespace

MeshMaking::MeshMaking(const FinishedRun& run, const RenderTurns& turns, MeshMaker maker)
    : run_(run), turns_(turns), maker_(std::move(maker)) {
  if (!maker_)
    found_ = fail(ErrorKind::input, "surface", "nobody was asked to make it",
                  "open the run with orbitfuse view");
}

void MeshMaking::start() {
  if (maker_ && !thread_.joinable()) thread_ = std::thread([this] { make(); });
}

void MeshMaking::stop() {
  stopped_ = true;
  if (thread_.joinable()) thread_.join();
}

Result<std::shared_ptr<const std::string>> MeshMaking::found() const {
  const std::lock_guard lock(mutex_);
  return found_;
}

void MeshMaking::let_pictures_first() const {
  const auto enough = std::chrono::steady_clock::now() + longest_wait;
  while (turns_.busy() && !stopped_ && std::chrono::steady_clock::now() < enough)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
}

void MeshMaking::make() {
  Progress progress;
  progress.cancel = &stopped_;
  progress.report = [this](const ProgressEvent&) { let_pictures_first(); };
  Result<std::string> made = maker_(run_, progress);
  const std::lock_guard lock(mutex_);
  if (made)
    found_ = std::make_shared<const std::string>(*std::move(made));
  else
    found_ = tl::unexpected(made.error());
}

}  // namespace orbitfuse::view
