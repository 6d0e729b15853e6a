// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "app/view/finished_run.hpp"
#include "app/view/mesh_making.hpp"
#include "core/http/page_options.hpp"

namespace orbitfuse::view {

/// The viewer of a finished run on a WebServer: one page with all it needs, the run's surface and
/// cameras, and pictures of both fields from anywhere, rendered on request. What it keeps of the
/// user's, bookmarks, goes to the run's folder. The surface is points until `make_mesh` has made
/// it.
class ViewServer {
 public:
  ViewServer(FinishedRun run, PageOptions options, MeshMaker make_mesh = {});
  ~ViewServer();

  /// Device error with the remedy when the port is taken or the address is not this machine's.
  Status start();
  /// Within a piece of a picture, whoever is connected.
  void stop();
  int port() const;
  std::vector<std::string> urls() const;
  const std::string& token() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace orbitfuse::view
