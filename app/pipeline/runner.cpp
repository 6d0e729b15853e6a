// SPDX-License-Identifier: BSD-3-Clause
#include "app/pipeline/runner.hpp"

#include <algorithm>
#include <set>

#include "app/pipeline/folder_lock.hpp"
#include "app/pipeline/out_folder.hpp"
#include "app/pipeline/result_folder.hpp"
#include "core/nested_text.hpp"
#include "core/system/clock.hpp"
#include "core/system/file_io.hpp"
#include "core/system/trace.hpp"
#include "core/system/utc_now.hpp"

namespace orbitfuse::pipeline {
namespace fs = std::filesystem;
using nlohmann::json;

namespace {

fs::path partial_folder(const fs::path& out, const std::string& stage) {
  return out / ".partial" / stage;
}
/// What an interrupted attempt was for and what it has cost so far.
fs::path attempt_file(const fs::path& out, const std::string& stage) {
  return out / ".partial" / (stage + ".json");
}

struct Attempt {
  std::string key;
  double cpu_s = 0, wall_s = 0;
};

Attempt read_attempt(const fs::path& file) {
  const auto text = read_file(file);
  const json j = text ? parse_json(*text) : json();
  try {
    return {j.at("key"), j.at("cpu_s"), j.at("wall_s")};
  } catch (const json::exception&) {
    return {};
  }
}

Status write_attempt(const fs::path& file, const Attempt& attempt) {
  return write_file_atomic(
      file,
      json{{"key", attempt.key}, {"cpu_s", attempt.cpu_s}, {"wall_s", attempt.wall_s}}.dump());
}

/// Later stages can't do better after these.
bool stops_everything(ErrorKind kind) {
  return kind == ErrorKind::cancelled || kind == ErrorKind::device || kind == ErrorKind::usage;
}

/// The first option whose value differs, for "why is this stage running again"; none: all alike.
std::optional<std::string> changed_option(const json& before, const json& now,
                                          const std::string& prefix = "") {
  if (before.is_object() && now.is_object()) {
    for (const auto& [key, value] : now.items()) {
      std::string path = prefix.empty() ? key : prefix + "." + key;
      if (!before.contains(key)) return path;
      if (auto inner = changed_option(before.at(key), value, path)) return inner;
    }
    if (before.size() <= now.size()) return std::nullopt;
    return prefix.empty() ? "options" : prefix;
  }
  return before == now ? std::nullopt : std::optional(prefix);
}

}  // namespace

std::string software_version() { return ORBITFUSE_VERSION; }

const StageStatus* RunSummary::find(const std::string& stage) const {
  const auto it = std::find_if(stages.begin(), stages.end(),
                               [&](const StageStatus& s) { return s.stage == stage; });
  return it == stages.end() ? nullptr : &*it;
}

std::vector<std::string> closure(const std::vector<Stage>& stages,
                                 const std::vector<std::string>& targets) {
  std::set<std::string> read;
  std::vector<std::string> names;
  for (auto it = stages.rbegin(); it != stages.rend(); ++it) {
    const bool target = targets.empty() || std::count(targets.begin(), targets.end(), it->name) > 0;
    if (!target && read.count(it->name) == 0) continue;
    names.insert(names.begin(), it->name);
    read.insert(it->needs.begin(), it->needs.end());
    read.insert(it->uses.begin(), it->uses.end());
  }
  return names;
}

Runner::Runner(std::vector<Stage> stages, RunOptions options, Progress progress)
    : stages_(std::move(stages)),
      options_(std::move(options)),
      progress_(std::move(progress)),
      closure_(closure(stages_, options_.targets)) {}

bool Runner::is_target(const std::string& stage) const {
  return options_.targets.empty() || std::find(options_.targets.begin(), options_.targets.end(),
                                               stage) != options_.targets.end();
}

bool Runner::wanted(const std::string& stage) const {
  return std::find(closure_.begin(), closure_.end(), stage) != closure_.end();
}

bool Runner::writes(const std::string& stage) const {
  return wanted(stage) && (!options_.targets_only || is_target(stage));
}

Runner::Key Runner::key_of(const Stage& stage) const {
  Key key;
  key.inputs["outside"] = stage.inputs_hash;
  for (const auto* list : {&stage.needs, &stage.uses})
    for (const std::string& name : *list) {
      const auto it = outputs_.find(name);
      key.inputs[name] = it == outputs_.end() ? "none" : it->second;
    }
  key.hash = content_hash(json{
      {"stage", stage.name},
      {"version", stage.version},
      {"options", stage.options},
      {"inputs", key.inputs}}.dump());
  return key;
}

bool Runner::forced(const Stage& stage) const { return options_.force && is_target(stage.name); }

std::optional<EarlierResult> Runner::earlier_result(const Stage& stage, const Key& key) const {
  const fs::path folder = options_.out / stage.name;
  const auto record = read_stage_record(folder);
  if (forced(stage) || !record || record->version != stage.version ||
      record->inputs != key.inputs || damage(folder, *record))
    return std::nullopt;
  return EarlierResult{folder, record->options, record->output.metrics};
}

std::optional<std::string> Runner::why_run(const Stage& stage, const Key& key,
                                           const Result<StageRecord>& record) const {
  if (forced(stage)) return "--force";
  if (!fs::exists(options_.out / stage.name / stage_record_file)) return "not done yet";
  if (!record) return "its done mark can't be read";
  if (stage.always) return "describes this run";
  if (record->key != key.hash) {
    if (record->version != stage.version) return "the stage's method has a new version";
    if (const auto option = changed_option(record->options, stage.options))
      return "option " + *option + " changed";
    for (const auto& [name, hash] : key.inputs) {
      const auto it = record->inputs.find(name);
      if (it == record->inputs.end() || it->second != hash)
        return name == "outside" ? "the session changed" : name + " changed";
    }
    return "its inputs changed";
  }
  return damage(options_.out / stage.name, *record);
}

StageContext Runner::context(fs::path folder, bool resume) const {
  StageContext context{.out = options_.out,
                       .folder = std::move(folder),
                       .resume = resume,
                       .progress = progress_,
                       .earlier_result = {},
                       .finished = {},
                       .earlier = &statuses_};
  for (const auto& [name, hash] : outputs_) context.finished.insert(name);
  return context;
}

/// The stage that has been made anew since, if there is one.
std::optional<std::string> Runner::earlier_input(const StageRecord& record) const {
  for (const auto& [name, hash] : record.inputs) {
    const auto input = outputs_.find(name);
    if (outdated_.contains(name) || (input != outputs_.end() && input->second != hash)) return name;
  }
  return std::nullopt;
}

/// Of a stage that is taken as it lies: why it can't be. What was made of earlier results is told
/// as a warning too, since it was there yesterday.
std::optional<std::string> Runner::unfit_as_it_lies(const Stage& stage,
                                                    const Result<StageRecord>& record,
                                                    StageStatus& status) {
  if (!record) return "it has not run yet";
  if (auto wrong = damage(options_.out / stage.name, *record)) return wrong;
  const std::optional<std::string> earlier = earlier_input(*record);
  if (!earlier) return std::nullopt;
  outdated_.insert(stage.name);
  status.output.warnings.push_back(
      fmt::format("left out, for it was made of an earlier {}; make it anew: orbitfuse run {}",
                  *earlier, options_.out.string()));
  return "it was made of an earlier " + *earlier;
}

StageStatus Runner::visit(const Stage& stage) {
  StageStatus status;
  status.stage = stage.name;
  status.options = stage.options;
  const auto is_done = [&](const std::string& name) { return outputs_.count(name) > 0; };
  const auto planned = [&](const std::string& name) {
    return is_done(name) && outputs_.at(name) == "planned";
  };

  const StageContext look = context({}, false);
  bool unknown = false;
  for (const auto* list : {&stage.needs, &stage.uses})
    for (const std::string& name : *list) unknown = unknown || planned(name);
  std::optional<std::string> reason = stage.pointless;
  if (!reason && !unknown && stage.absent) reason = stage.absent(look);
  if (reason) {
    status.state = StageState::absent;
    status.why = *reason;
    return status;
  }
  for (const std::string& name : stage.needs)
    if (!is_done(name)) {
      const auto it = std::find_if(statuses_.begin(), statuses_.end(),
                                   [&](const StageStatus& s) { return s.stage == name; });
      // The root cause reads better than a chain of blocked stages.
      const bool chained = it != statuses_.end() && it->state == StageState::blocked;
      status.state = it != statuses_.end() && it->state == StageState::absent ? StageState::absent
                                                                              : StageState::blocked;
      status.why = chained || status.state == StageState::absent
                       ? it->why
                       : "needs " + name + ", which failed";
      return status;
    }

  const Key key = key_of(stage);
  const auto record = read_stage_record(options_.out / stage.name);
  const bool as_it_lies = !writes(stage.name);
  if (as_it_lies) {
    if (const auto wrong = unfit_as_it_lies(stage, record, status)) {
      status.state = StageState::absent;
      status.why = *wrong;
      return status;
    }
  }
  std::optional<std::string> why;
  if (!as_it_lies) why = unknown ? "a stage it reads will run" : why_run(stage, key, record);
  if (!why) {
    status.state = StageState::unchanged;
    status.output = record->output;
    status.cpu_s = record->cpu_s;
    status.wall_s = record->wall_s;
    outputs_[stage.name] = record->outputs_hash();
    return status;
  }
  if (options_.dry_run) {
    status.state = StageState::planned;
    status.why = *why;
    outputs_[stage.name] = "planned";
    return status;
  }
  return execute(stage, key, *std::move(why));
}

StageStatus Runner::execute(const Stage& stage, const Key& key, std::string why) {
  StageStatus status;
  status.stage = stage.name;
  status.options = stage.options;
  status.state = StageState::planned;
  status.why = std::move(why);
  on_status(status);

  const fs::path folder = partial_folder(options_.out, stage.name);
  const fs::path attempt_path = attempt_file(options_.out, stage.name);
  Attempt attempt = read_attempt(attempt_path);
  const bool resume = options_.resume && attempt.key == key.hash && fs::exists(folder);
  if (!resume) attempt = {key.hash, 0, 0};

  const TraceSpan span(stage.name);
  const UsageClock clock;
  const auto work = [&]() -> Result<StageOutput> {
    ORBITFUSE_TRY(progress_.check(stage.name));
    if (!resume) ORBITFUSE_TRY(remove_tree(folder));
    ORBITFUSE_TRY(make_folder(folder));
    ORBITFUSE_TRY(write_attempt(attempt_path, attempt));
    StageContext given = context(folder, resume);
    given.earlier_result = [&] { return earlier_result(stage, key); };
    return stage.run(given);
  };
  auto result = work();
  attempt.cpu_s += clock.cpu_s();
  attempt.wall_s += clock.wall_s();
  status.cpu_s = attempt.cpu_s;
  status.wall_s = attempt.wall_s;

  const auto finish = [&]() -> Status {
    StageRecord record{.stage = stage.name,
                       .key = key.hash,
                       .software_version = software_version(),
                       .finished_utc = utc_now_text(),
                       .version = stage.version,
                       .options = stage.options,
                       .inputs = key.inputs,
                       .outputs = {},
                       .output = *result,
                       .cpu_s = attempt.cpu_s,
                       .wall_s = attempt.wall_s};
    ORBITFUSE_ASSIGN(record.outputs, list_outputs(folder));
    ORBITFUSE_TRY(write_stage_record(folder, record));
    ORBITFUSE_TRY(replace_folder(folder, options_.out / stage.name));
    ORBITFUSE_TRY(remove_tree(failed_folder(options_.out, stage.name)));
    ORBITFUSE_TRY(remove_tree(attempt_path));
    outputs_[stage.name] = record.outputs_hash();
    return {};
  };
  Status finished = result ? finish() : tl::unexpected(result.error());
  if (finished) {
    status.state = StageState::ran;
    status.output = *std::move(result);
    return status;
  }
  status.state = StageState::failed;
  status.error = finished.error();
  if (status.error->kind == ErrorKind::cancelled) status.error->remedy = "run again with --resume";
  // What was done so far helps --resume after Ctrl-C or a full disk, and a look after a missed
  // gate; it never takes the place of an earlier result.
  if (stops_everything(status.error->kind)) {
    (void)write_attempt(attempt_path, attempt);
  } else {
    if (status.error->kind == ErrorKind::quality)
      keep_failed(folder, options_.out, stage.name, *status.error);
    (void)remove_tree(folder);
    (void)remove_tree(attempt_path);
  }
  return status;
}

Status Runner::remove_all() const {
  for (const Stage& stage : stages_) ORBITFUSE_TRY(check_places(options_.out, stage.name));
  // Killed in between, what is left must not pass for these inputs' nor be named after the others.
  for (const std::string& file : options_.replaced_files)
    ORBITFUSE_TRY(remove_tree(options_.out / file));
  ORBITFUSE_TRY(remove_tree(options_.out / ".partial"));
  // Poses, by which inputs are told, are the first stages: they go last.
  for (auto stage = stages_.rbegin(); stage != stages_.rend(); ++stage) {
    ORBITFUSE_TRY(remove_tree(failed_folder(options_.out, stage->name)));
    ORBITFUSE_TRY(remove_tree(options_.out / stage->name));
  }
  return {};
}

RunSummary Runner::run() {
  RunSummary summary;
  FolderLock lock;
  Status ready = check_out_folder(options_.out);
  for (const Stage& stage : stages_)
    if (ready && writes(stage.name)) ready = check_places(options_.out, stage.name);
  if (ready && !options_.dry_run) {
    ready = make_folder(options_.out);
    if (ready) ready = lock.acquire(options_.out / ".lock");
    if (ready && options_.replace_all) ready = remove_all();
  }
  if (!ready) {
    summary.error = ready.error();
    return summary;
  }
  for (Stage& stage : stages_) {
    if (!wanted(stage.name)) continue;
    before_stage(stage, statuses_);
    statuses_.push_back(visit(stage));
    const StageStatus& status = statuses_.back();
    on_status(status);
    if (!status.error) continue;
    if (!summary.error) summary.error = status.error;
    if (stops_everything(status.error->kind)) {
      summary.error = status.error;
      break;
    }
  }
  std::error_code ignored;
  if (!options_.dry_run) fs::remove(options_.out / ".partial", ignored);  // only when empty
  summary.stages = statuses_;
  return summary;
}

}  // namespace orbitfuse::pipeline
