// SPDX-License-Identifier: BSD-3-Clause
#include "app/view/measuring.hpp"

#include "app/stages/measurement_scene.hpp"
#include "app/stages/metric_scale.hpp"
#include "recon/measurement/measure.hpp"
#include "recon/measurement/measurement_file.hpp"

namespace orbitfuse::view {
using nlohmann::json;

namespace {

Progress until(const std::atomic<bool>* gone) {
  Progress progress;
  progress.cancel = gone;
  return progress;
}

/// In the scale that the run has now: the scene keeps the one that it was loaded with.
Status bring_to_scale_of(const std::filesystem::path& out, measurement::Measurements& saved) {
  ORBITFUSE_ASSIGN(const auto scale, stages::scale_of_run(out));
  bring_to_scale(saved, scale ? std::optional(scale->metres_per_unit) : std::nullopt,
                 scale ? scale->relative_uncertainty : 0);
  return {};
}

Result<json> answer_in_scale_of(const std::filesystem::path& out,
                                const measurement::Request& request,
                                const measurement::Answer& answer) {
  measurement::Measurements one{"", {{request.name, "", request, to_json(answer)}}, {}};
  ORBITFUSE_TRY(bring_to_scale_of(out, one));
  return one.list.front().answer;
}

}  // namespace

/// Where the run was made again, its places are others than those that the viewer shows.
Status Measuring::check_same_run() const {
  if (run_.identity.empty()) return {};
  ORBITFUSE_ASSIGN(const std::string now, identity_of_run(run_.out));
  if (now == run_.identity) return {};
  return fail(ErrorKind::input, run_.out.string(),
              "the run was made again since the viewer was opened", "open the viewer again");
}

Result<const measurement::ThermalScene*> Measuring::scene() {
  ORBITFUSE_TRY(check_same_run());
  const std::lock_guard lock(mutex_);
  if (scene_) return scene_.get();
  if (!run_.session)
    return fail(ErrorKind::input, "measurements", "the session is not where the run read it",
                "bring it back, and open the viewer again");
  ORBITFUSE_ASSIGN(measurement::ThermalScene loaded,
                   stages::load_measurement_scene(run_.out, *run_.session));
  scene_ = std::make_unique<measurement::ThermalScene>(std::move(loaded));
  return scene_.get();
}

template <class Work>
auto Measuring::in_turn(Work work) -> decltype(work()) {
  if (!places_.try_acquire())
    return fail(ErrorKind::unavailable, "measurements", "others are being measured",
                "try again in a moment");
  struct Release {
    std::counting_semaphore<4>& places;
    ~Release() { places.release(); }
  } const release{places_};
  return work();
}

Result<json> Measuring::point_at(const Shot& shot, const Eigen::Vector2d& pixel,
                                 const std::atomic<bool>* gone) {
  return in_turn([&]() -> Result<json> {
    ORBITFUSE_ASSIGN(const measurement::ThermalScene* scene, this->scene());
    const PosedView view{"the viewer's picture", shot.camera, shot.cam_from_world};
    ORBITFUSE_ASSIGN(const measurement::SurfacePoint found,
                     scene->surface_at(view, pixel, until(gone)));
    const Eigen::Vector3d& p = found.position;
    return json{{"point", {p.x(), p.y(), p.z()}}};
  });
}

Result<json> Measuring::answer(const json& asked, const std::atomic<bool>* gone) {
  return in_turn([&]() -> Result<json> {
    ORBITFUSE_ASSIGN(const measurement::Request request, measurement::request_of_json(asked));
    ORBITFUSE_ASSIGN(const measurement::ThermalScene* scene, this->scene());
    ORBITFUSE_ASSIGN(const measurement::Answer answer, measure(*scene, request, until(gone)));
    ORBITFUSE_ASSIGN(const json scaled, answer_in_scale_of(run_.out, request, answer));
    return json{{"request", to_json(request)}, {"answer", scaled}};
  });
}

Result<json> Measuring::add(const json& asked, const std::atomic<bool>* gone) {
  return in_turn([&]() -> Result<json> {
    ORBITFUSE_ASSIGN(const measurement::Request request, measurement::request_of_json(asked));
    ORBITFUSE_ASSIGN(const measurement::ThermalScene* scene, this->scene());
    ORBITFUSE_ASSIGN(const measurement::Anchored kept,
                     measure_anchored(*scene, request, until(gone)));
    ORBITFUSE_ASSIGN(const json scaled, answer_in_scale_of(run_.out, kept.request, kept.answer));
    ORBITFUSE_TRY(measurement::add_measurement(run_.out / measurement::measurements_file,
                                               scene->identity(),
                                               {request.name, "", kept.request, scaled}));
    return list();
  });
}

Result<json> Measuring::remove(const std::string& name) {
  ORBITFUSE_ASSIGN(const measurement::ThermalScene* scene, this->scene());
  ORBITFUSE_TRY(measurement::remove_measurement(run_.out / measurement::measurements_file,
                                                scene->identity(), name));
  return list();
}

Result<json> Measuring::list() {
  ORBITFUSE_ASSIGN(const measurement::ThermalScene* scene, this->scene());
  ORBITFUSE_ASSIGN(
      measurement::Measurements saved,
      measurement::load_measurements(run_.out / measurement::measurements_file, scene->identity()));
  ORBITFUSE_TRY(bring_to_scale_of(run_.out, saved));
  json entries = json::array();
  for (const measurement::SavedMeasurement& m : saved.list) entries.push_back(to_json(m));
  return entries;
}

}  // namespace orbitfuse::view
