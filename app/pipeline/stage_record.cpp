// SPDX-License-Identifier: BSD-3-Clause
#include "app/pipeline/stage_record.hpp"

#include <algorithm>

#include "core/nested_text.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::pipeline {
namespace fs = std::filesystem;
using nlohmann::json;

std::string_view name(StageState state) {
  switch (state) {
    case StageState::ran:
      return "ran";
    case StageState::unchanged:
      return "unchanged";
    case StageState::absent:
      return "absent";
    case StageState::blocked:
      return "blocked";
    case StageState::failed:
      return "failed";
    case StageState::planned:
      return "planned";
  }
  return "unknown";
}

namespace {

constexpr const char* kind_names[] = {"usage",   "input",       "device",
                                      "quality", "unavailable", "cancelled"};

/// Hash of all else: what reads a record relies on the types of what it holds.
constexpr const char* check_key = "check";

bool is_altered(json& record) {
  const json check = record.at(check_key);
  record.erase(check_key);
  return check != content_hash(record.dump());
}

json outputs_json(const std::vector<OutputFile>& outputs) {
  json list = json::array();
  for (const OutputFile& o : outputs)
    list.push_back({{"file", o.file}, {"bytes", o.bytes}, {"hash", o.hash}});
  return list;
}

}  // namespace

json to_json(const Skip& skip) {
  return {{"what", skip.what}, {"why", skip.why}, {"effect", skip.effect}};
}

json to_json(const Error& error) {
  return {{"kind", kind_names[static_cast<int>(error.kind)]},
          {"where", error.where},
          {"found", error.found},
          {"remedy", error.remedy},
          {"message", error.message()}};
}

std::string StageRecord::outputs_hash() const { return content_hash(outputs_json(outputs).dump()); }

json to_json(const StageRecord& r) {
  json skips = json::array();
  for (const Skip& skip : r.output.skips) skips.push_back(to_json(skip));
  return {{"schema", stage_record_schema},
          {"stage", r.stage},
          {"version", r.version},
          {"key", r.key},
          {"orbitfuse", r.software_version},
          {"finished_utc", r.finished_utc},
          {"options", r.options},
          {"inputs", r.inputs},
          {"metrics", r.output.metrics},
          {"skips", skips},
          {"warnings", r.output.warnings},
          {"cpu_s", r.cpu_s},
          {"wall_s", r.wall_s},
          {"outputs", outputs_json(r.outputs)}};
}

Result<StageRecord> read_stage_record(const fs::path& folder) {
  const fs::path file = folder / stage_record_file;
  ORBITFUSE_ASSIGN(const std::string text, read_file(file));
  try {
    json j = nests_too_deep(text) ? json() : json::parse(text);
    if (j.at("schema") != stage_record_schema)
      return fail(ErrorKind::input, file.string(), "schema " + j.at("schema").dump(),
                  "run the stage again");
    if (is_altered(j))
      return fail(ErrorKind::input, file.string(), "not what the stage wrote: edited, or damaged",
                  "run the stage again");
    StageRecord r;
    j.at("stage").get_to(r.stage);
    j.at("version").get_to(r.version);
    j.at("key").get_to(r.key);
    j.at("orbitfuse").get_to(r.software_version);
    j.at("finished_utc").get_to(r.finished_utc);
    r.options = j.at("options");
    j.at("inputs").get_to(r.inputs);
    r.output.metrics = j.at("metrics");
    for (const json& s : j.at("skips"))
      r.output.skips.push_back({s.at("what"), s.at("why"), s.at("effect")});
    j.at("warnings").get_to(r.output.warnings);
    j.at("cpu_s").get_to(r.cpu_s);
    j.at("wall_s").get_to(r.wall_s);
    for (const json& o : j.at("outputs"))
      r.outputs.push_back({o.at("file"), o.at("bytes"), o.at("hash")});
    return r;
  } catch (const json::exception& e) {
    return fail(ErrorKind::input, file.string(), e.what(), "run the stage again");
  }
}

Status write_stage_record(const fs::path& folder, const StageRecord& record) {
  json j = to_json(record);
  j[check_key] = content_hash(j.dump());
  return write_file_atomic(folder / stage_record_file, j.dump(2) + "\n");
}

std::set<std::string> finished_stages(const fs::path& out,
                                      const std::vector<std::string>& stage_names) {
  std::set<std::string> names;
  std::error_code unreadable;
  for (const auto& entry : fs::directory_iterator(out, unreadable)) {
    const std::string name = entry.path().filename().string();
    const fs::file_type mark = fs::status(entry.path() / stage_record_file, unreadable).type();
    // One that may not be looked at can be there: whoever reads it says why it can't be.
    const bool unknown =
        mark == fs::file_type::none &&
        std::find(stage_names.begin(), stage_names.end(), name) != stage_names.end();
    if (unknown || (mark != fs::file_type::none && mark != fs::file_type::not_found))
      names.insert(name);
  }
  return names;
}

std::vector<std::string> out_of_date(const fs::path& out, const std::set<std::string>& stages) {
  std::map<std::string, StageRecord> records;
  for (const std::string& stage : finished_stages(out, {}))  // whose records can be read
    if (auto record = read_stage_record(out / stage)) records.emplace(stage, *std::move(record));
  std::vector<std::string> late;
  for (const auto& [stage, record] : records) {
    if (!stages.contains(stage)) continue;
    for (const auto& [name, hash] : record.inputs)
      if (const auto input = records.find(name);
          input != records.end() && input->second.outputs_hash() != hash)
        late.push_back(stage + " was made of an earlier " + name);
  }
  return late;
}

bool lies_in_a_stage(const fs::path& out, const fs::path& target) {
  std::error_code unreadable;
  const auto whole = [&](const fs::path& path) {  // a name that is not there yet stays relative
    return fs::weakly_canonical(fs::absolute(path, unreadable), unreadable);
  };
  const fs::path run = whole(out), to = whole(target);
  const fs::path inside = to.lexically_relative(run);
  return !inside.empty() && inside != "." &&
         finished_stages(out, {}).contains(inside.begin()->string());
}

Result<std::vector<OutputFile>> list_outputs(const fs::path& folder) {
  std::vector<OutputFile> outputs;
  std::error_code ec;
  for (fs::recursive_directory_iterator it(folder, ec), end; !ec && it != end; it.increment(ec)) {
    if (!it->is_regular_file()) continue;
    const std::string file = fs::relative(it->path(), folder).generic_string();
    if (file == stage_record_file) continue;
    ORBITFUSE_ASSIGN(std::string hash, file_hash(it->path()));
    outputs.push_back({file, it->file_size(), std::move(hash)});
  }
  if (ec) return fail(ErrorKind::device, folder.string(), ec.message(), "check the disk");
  std::sort(outputs.begin(), outputs.end(),
            [](const OutputFile& a, const OutputFile& b) { return a.file < b.file; });
  return outputs;
}

std::optional<std::string> damage(const fs::path& folder, const StageRecord& record) {
  const auto found = list_outputs(folder);
  if (!found) return found.error().message();
  for (const OutputFile& want : record.outputs) {
    const auto it = std::find_if(found->begin(), found->end(),
                                 [&](const OutputFile& o) { return o.file == want.file; });
    if (it == found->end()) return want.file + " is missing";
    if (*it != want) return want.file + " was changed";
  }
  return std::nullopt;
}

}  // namespace orbitfuse::pipeline
