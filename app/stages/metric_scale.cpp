// SPDX-License-Identifier: BSD-3-Clause
#include "app/stages/metric_scale.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/pipeline/stage_record.hpp"
#include "app/stages/artifacts.hpp"
#include "app/stages/measurement_scene.hpp"
#include "core/nested_text.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::stages {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;

/// A file that can't be looked at is there: it is named by whoever reads it.
bool is_there(const fs::path& file) {
  std::error_code error;
  return fs::symlink_status(file, error).type() != fs::file_type::not_found;
}
}  // namespace

Status MetricScale::validate(const std::string& where) const {
  if (!(metres_per_unit > 1e-6 && metres_per_unit < 1e6))
    return fail(ErrorKind::input, where, fmt::format("{} metres a unit", metres_per_unit),
                "check the places and the distance");
  if (!(relative_uncertainty >= 0 && relative_uncertainty < 1))
    return fail(ErrorKind::input, where,
                fmt::format("an uncertainty of {:.0f} %", 100 * relative_uncertainty),
                "measure a longer distance, between places that are well seen");
  return {};
}

json to_json(const MetricScale& scale) {
  return {{"metres_per_unit", scale.metres_per_unit},
          {"relative_uncertainty", scale.relative_uncertainty},
          {"source", scale.source},
          {"how", scale.how}};
}

Result<std::string> world_identity(const fs::path& out) {
  const pipeline::StageContext context = context_of_run(out);
  const std::string stage = is_in_visible_world(context) || !context.has("poses_thermal")
                                ? "poses_visible"
                                : "poses_thermal";
  if (!context.has(stage))
    return fail(ErrorKind::input, out.string(), "no finished poses in it",
                "name the --out folder of a run");
  ORBITFUSE_ASSIGN(const pipeline::StageRecord record,
                   pipeline::read_stage_record(context.of(stage)));
  return stage + " " + record.outputs_hash();
}

Status save_metric_scale(const fs::path& out, const std::string& world, const MetricScale& scale) {
  ORBITFUSE_TRY(scale.validate(scale_file));
  json j = to_json(scale);
  j["schema"] = 1;
  j["world"] = content_hash(world);
  return write_json(out / scale_file, j);
}

Result<std::optional<MetricScale>> load_metric_scale(const fs::path& out,
                                                     const std::string& world) {
  const fs::path file = out / scale_file;
  if (!is_there(file)) return std::nullopt;
  const std::string remedy = fmt::format(
      "tell the scale again (orbitfuse export {} --distance A B LENGTH), or delete the file",
      out.string());
  const auto text = read_file(file);
  if (!text) return fail(ErrorKind::input, file.string(), text.error().found, remedy);
  const json j = parse_json(*text);
  if (j.is_discarded()) return fail(ErrorKind::input, file.string(), json_fault(*text), remedy);
  const JsonFields fields(j, file.string() + ": ", {ErrorKind::input, remedy});
  int schema = 0;
  std::string of_world;
  ORBITFUSE_TRY(fields.get_all("schema", schema, "world", of_world));
  if (schema != 1) return fields.wrong("schema", "1");
  if (of_world != content_hash(world))
    return fail(ErrorKind::input, file.string(), "a scale of other poses than the run's", remedy);
  MetricScale scale;
  ORBITFUSE_TRY(fields.get_all("metres_per_unit", scale.metres_per_unit, "relative_uncertainty",
                               scale.relative_uncertainty));
  ORBITFUSE_TRY(fields.get_all("source", scale.source, "how", scale.how));
  ORBITFUSE_TRY(scale.validate(file.string()));
  return scale;
}

Result<std::optional<MetricScale>> scale_of_run(const fs::path& out) {
  if (!is_there(out / scale_file)) return std::nullopt;
  ORBITFUSE_ASSIGN(const std::string world, world_identity(out));
  return load_metric_scale(out, world);
}

std::optional<MetricScale> agreed_scale(const MetricScale& a, const MetricScale& b) {
  constexpr double rounding = 1e-6;  // one that claims to be exact still has digits
  const double variance_a = std::pow(std::max(a.relative_uncertainty, rounding), 2),
               variance_b = std::pow(std::max(b.relative_uncertainty, rounding), 2);
  const double apart = std::log(b.metres_per_unit / a.metres_per_unit);
  if (!(std::abs(apart) <= 3 * std::sqrt(variance_a + variance_b))) return std::nullopt;
  if (a.source == b.source) return variance_b < variance_a ? b : a;
  const double share_of_b = variance_a / (variance_a + variance_b);
  return MetricScale{
      a.metres_per_unit * std::exp(share_of_b * apart),
      std::sqrt(variance_a * (1 - share_of_b)),
      a.source + " and " + b.source,
      a.how + "; " + b.how,
  };
}

std::string uncertainty_words(const MetricScale& scale) {
  constexpr double of_90_percent = 1.645;  // standard deviations
  return fmt::format("{:.1f} % in 90 of 100 cases",
                     100 * of_90_percent * scale.relative_uncertainty);
}

std::string scale_words(const Result<std::optional<MetricScale>>& scale) {
  if (!scale)
    return "lengths are in the unit of the run, for its scale can't be used: " +
           scale.error().message();
  if (!*scale) return "lengths are in the unit of the run; no scale in metres is known";
  return fmt::format("1 unit of the run is {:.4f} m, +- {} ({})", (*scale)->metres_per_unit,
                     uncertainty_words(**scale), (*scale)->source);
}

}  // namespace orbitfuse::stages
