// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <atomic>
#include <memory>
#include <mutex>
#include <nlohmann/json.hpp>
#include <semaphore>

#include "app/view/finished_run.hpp"
#include "app/view/layers.hpp"
#include "recon/measurement/thermal_scene.hpp"

namespace orbitfuse::view {

/// Measurements of the run that the viewer shows, by recon/measurement and in the same
/// measurements.json as the command line's. Their world is the viewer's frame. Unavailable error
/// where several are being measured already: each holds a thread of the server. Input error, of
/// all, where the run was made again since the viewer was opened.
class Measuring {
 public:
  /// The run must outlive it.
  explicit Measuring(const FinishedRun& run) : run_(run) {}

  /// Where the thermal field's surface is under a pixel. Input error: there is none.
  /// `gone`, here and below: set when nobody waits any more (WebRequest::gone); the error is then
  /// "cancelled".
  Result<nlohmann::json> point_at(const Shot& shot, const Eigen::Vector2d& pixel,
                                  const std::atomic<bool>* gone);
  /// {"request", "answer"} of a request as docs/formats.md has it.
  Result<nlohmann::json> answer(const nlohmann::json& request, const std::atomic<bool>* gone);
  /// Measured again and saved; then as list(). Unavailable, cancelled: nothing was saved.
  Result<nlohmann::json> add(const nlohmann::json& request, const std::atomic<bool>* gone);
  /// As list(), without the one of that name.
  Result<nlohmann::json> remove(const std::string& name);
  /// [{"name", "created", "request", "answer"}]: what is saved. Never unavailable.
  Result<nlohmann::json> list();

 private:
  Status check_same_run() const;
  Result<const measurement::ThermalScene*> scene();
  template <class Work>
  auto in_turn(Work work) -> decltype(work());

  const FinishedRun& run_;
  std::counting_semaphore<4> places_{4};
  std::mutex mutex_;  ///< of the first use, which loads the scene
  std::unique_ptr<measurement::ThermalScene> scene_;
};

}  // namespace orbitfuse::view
