// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "app/pipeline/stage.hpp"

namespace orbitfuse::pipeline {

inline constexpr int stage_record_schema = 2;
inline constexpr const char* stage_record_file = "stage.json";

struct OutputFile {
  std::string file;  ///< relative to the stage's folder
  std::uint64_t bytes = 0;
  std::string hash;
  bool operator==(const OutputFile&) const = default;
};

/// stage.json: the done mark of a stage, written last. A folder without one was never finished.
struct StageRecord {
  std::string stage, key, software_version, finished_utc;
  int version = 1;
  nlohmann::json options;
  std::map<std::string, std::string> inputs;  ///< name -> content hash
  std::vector<OutputFile> outputs;
  StageOutput output;
  double cpu_s = 0, wall_s = 0;

  /// Identity of what the stage made; what stages behind it depend on.
  std::string outputs_hash() const;
};

nlohmann::json to_json(const StageRecord& record);
Result<StageRecord> read_stage_record(const std::filesystem::path& folder);
Status write_stage_record(const std::filesystem::path& folder, const StageRecord& record);

/// Folders of a run that have a done mark, as they lie there: files may be damaged or out of date.
/// None where the run's folder can't be read; a folder that can't be, of the name of one of these
/// stages, is taken for one that has its mark, so that it is named where it is needed. Others
/// ("backup") are the user's.
std::set<std::string> finished_stages(const std::filesystem::path& out,
                                      const std::vector<std::string>& stage_names);

/// Every file below the folder except the done mark, sorted by name.
Result<std::vector<OutputFile>> list_outputs(const std::filesystem::path& folder);
/// The first way in which the folder differs from the record; none where it is intact.
std::optional<std::string> damage(const std::filesystem::path& folder, const StageRecord& record);

/// Which of these stages were made of other results than those that lie in the run now, one
/// sentence a stage: "train_thermal was made of an earlier poses_visible".
std::vector<std::string> out_of_date(const std::filesystem::path& out,
                                     const std::set<std::string>& stages);

/// `target`, which a verb is asked to write, lies inside of a finished stage of the run. Its next
/// run would take that for damage.
bool lies_in_a_stage(const std::filesystem::path& out, const std::filesystem::path& target);

nlohmann::json to_json(const Skip& skip);
nlohmann::json to_json(const Error& error);

}  // namespace orbitfuse::pipeline
