// SPDX-License-Identifier: BSD-3-Clause
#include "capture/live/position_policy.hpp"

#include <fmt/format.h>

#include <cmath>

namespace orbitfuse {
namespace {

/// Refused for what another frame from the same place may not have.
bool to_repeat(Refusal last) {
  return last == Refusal::nuc || last == Refusal::blurred || last == Refusal::featureless ||
         last == Refusal::badly_exposed || last == Refusal::moving;
}

class CarriedStations final : public PositionPolicy {
 public:
  CarriedStations(const Coverage& coverage, Modality modality)
      : coverage_(coverage), modality_(modality) {}

  std::optional<OrbitPosition> at_key(const KeyPress&) override { return std::nullopt; }
  GuideStep next_step(const CameraSight& sight) const override {
    if (!sight.any_frame) return {"no frame yet"};
    return {coverage_.instruction(modality_, sight.position, sight.last)};
  }

 private:
  const Coverage& coverage_;
  Modality modality_;
};

class OperatorKey : public PositionPolicy {
 public:
  OperatorKey(const Coverage& coverage, Modality modality)
      : coverage_(coverage), modality_(modality) {}

  /// The next missing station, wherever the camera stood before.
  std::optional<OrbitPosition> at_key(const KeyPress&) override { return next_station(); }
  GuideStep next_step(const CameraSight& sight) const override {
    if (sight.announced && to_repeat(sight.last)) return {text(sight.last)};
    const std::optional<OrbitPosition> next = next_station();
    if (!next) return {coverage_.instruction(modality_, sight.position, sight.last)};
    return {
        fmt::format("go to azimuth {:.0f}°, {:.0f}° high", next->azimuth_deg, next->elevation_deg),
        Awaited::key};
  }

 protected:
  std::optional<OrbitPosition> next_station() const {
    const std::vector<const Sector*> missing = coverage_.missing(modality_);
    if (missing.empty()) return std::nullopt;
    return OrbitPosition{missing.front()->azimuth_deg, missing.front()->elevation_deg, 0, 0};
  }

  const Coverage& coverage_;
  const Modality modality_;
};

class MatInView final : public OperatorKey {
 public:
  MatInView(const Coverage& coverage, Modality modality, const PositionFinder& finder)
      : OperatorKey(coverage, modality), finder_(finder) {}

  const PositionFinder* finder() const override { return &finder_; }
  GuideStep next_step(const CameraSight& sight) const override {
    return {coverage_.instruction(modality_, sight.position, sight.last)};
  }

 private:
  const PositionFinder& finder_;
};

class TurntableSteps final : public PositionPolicy {
 public:
  TurntableSteps(const Coverage& coverage, Turntable& table) : coverage_(coverage), table_(table) {}

  std::optional<OrbitPosition> at_key(const KeyPress& key) override {
    if (view_.counts_photos) return std::nullopt;  // its photos tell, and may come late
    return at_count(key.number.value());
  }

  std::optional<OrbitPosition> of_photo(const FrameRecord& photo) override {
    if (table_.keys() == 0) view_.counts_photos = true;
    if (view_.counts_photos) {
      const double azimuth_deg = table_.photo(view_);
      return OrbitPosition{azimuth_deg, loop_of(table_.turn(view_, azimuth_deg)), 0, 0};
    }
    // When a file was written is no time that a photo was taken at.
    if (photo.host_time_ns && !photo.has_flag(FrameFlag::file_time)) {
      if (const std::optional<int> key = table_.key_before(*photo.host_time_ns))
        return at_count(*key);
    }
    OrbitPosition somewhere = at_count(table_.keys());
    somewhere.sigma_deg = 180;  // it may be from any station
    return somewhere;
  }

  void resume_at(const Station& station) override { table_.resume_at(view_, station); }

  GuideStep next_step(const CameraSight& sight) const override {
    const bool repeat = to_repeat(sight.last);
    if (repeat && sight.announced && !view_.counts_photos) return {text(sight.last)};
    const Awaited then = view_.counts_photos ? Awaited::photo
                         : view_.start_deg   ? Awaited::key
                                             : Awaited::key_or_photo;
    if (!view_.start_deg && !table_.begun()) return {"put the table at its start", then};
    std::string words = repeat ? text(sight.last) + "; " : "";
    words += fmt::format("turn the table by {:g}°", std::abs(table_.step_deg()));
    const double elevation_deg = loop_of(table_.turn_after_step(view_));
    if (sight.position && elevation_deg != sight.position->elevation_deg)
      words += fmt::format(", move the camera to {:g}° high", elevation_deg);
    return {words, then};
  }

 private:
  OrbitPosition at_count(int key) {
    return {table_.azimuth_deg(key), loop_of(table_.turn_at_key(view_, key)), 0, 0};
  }
  double loop_of(std::size_t turn) const {
    const std::vector<double>& loops = coverage_.plan().loop_elevations_deg;
    return loops[turn % loops.size()];
  }

  const Coverage& coverage_;
  Turntable& table_;
  TableView view_;
};

}  // namespace

std::unique_ptr<PositionPolicy> carried_stations(const Coverage& coverage, Modality modality) {
  return std::make_unique<CarriedStations>(coverage, modality);
}

std::unique_ptr<PositionPolicy> operator_key(const Coverage& coverage, Modality modality) {
  return std::make_unique<OperatorKey>(coverage, modality);
}

std::unique_ptr<PositionPolicy> mat_in_view(const Coverage& coverage, Modality modality,
                                            const PositionFinder& finder) {
  return std::make_unique<MatInView>(coverage, modality, finder);
}

std::unique_ptr<PositionPolicy> turntable_steps(const Coverage& coverage, Turntable& table) {
  return std::make_unique<TurntableSteps>(coverage, table);
}

}  // namespace orbitfuse
