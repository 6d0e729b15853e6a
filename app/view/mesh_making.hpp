// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>

#include "app/view/finished_run.hpp"
#include "app/view/render_turns.hpp"

namespace orbitfuse::view {

/// A run's surface as triangles, in the bytes of packed(). Called once, from a thread of its own.
using MeshMaker = std::function<Result<std::string>(const FinishedRun&, const Progress&)>;

/// Makes the surface while the viewer is looked at already, and lets pictures go first.
class MeshMaking {
 public:
  /// Both must outlive it. No maker: found() is an error.
  MeshMaking(const FinishedRun& run, const RenderTurns& turns, MeshMaker maker);
  ~MeshMaking() { stop(); }
  MeshMaking(const MeshMaking&) = delete;
  MeshMaking& operator=(const MeshMaking&) = delete;

  void start();
  void stop();
  /// Null: it is being made. Errors: the maker's.
  Result<std::shared_ptr<const std::string>> found() const;

 private:
  void make();
  void let_pictures_first() const;

  const FinishedRun& run_;
  const RenderTurns& turns_;
  MeshMaker maker_;
  std::atomic<bool> stopped_{false};
  mutable std::mutex mutex_;
  Result<std::shared_ptr<const std::string>> found_;
  std::thread thread_;
};

}  // namespace orbitfuse::view
