// SPDX-License-Identifier: BSD-3-Clause
#include "app/farm/slurm.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/system/file_io.hpp"
#include "core/system/process.hpp"
#include "core/system/scratch_folder.hpp"

namespace orbitfuse::farm {
namespace fs = std::filesystem;

Result<std::string> slurm_output(const std::vector<std::string>& command,
                                 const Progress& progress) {
  ORBITFUSE_ASSIGN(const ScratchFolder scratch, ScratchFolder::make());
  const fs::path log = scratch.path() / "output";
  const auto code = run_process(command, log, "farm", progress);
  if (!code) {
    Error error = code.error();
    if (error.kind == ErrorKind::unavailable)
      error.remedy = "run this where Slurm is installed, or without --slurm on this machine";
    return tl::unexpected(error);
  }
  ORBITFUSE_ASSIGN(std::string text, read_file(log, max_text_bytes));
  while (!text.empty() && text.back() == '\n') text.pop_back();
  if (*code == 0) return text;
  std::replace(text.begin(), text.end(), '\n', ' ');
  const bool dead = text.find("contact slurm controller") != std::string::npos ||
                    text.find("Connection refused") != std::string::npos;
  if (dead)
    return fail(ErrorKind::unavailable, command.front(), text,
                "ask for the controller (scontrol ping); then: orbitfuse farm resume");
  return fail(ErrorKind::usage, command.front(), text,
              "sinfo lists partitions and what their nodes have; cores, memory and time of each "
              "stage are in farm.json");
}

std::string shell_word(const std::string& text) {
  std::string word = "'";
  for (const char c : text) word += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return word + "'";
}

std::string index_list(const std::vector<std::size_t>& indices) {
  std::string list;
  for (std::size_t i = 0; i < indices.size();) {
    std::size_t end = i;
    while (end + 1 < indices.size() && indices[end + 1] == indices[end] + 1) ++end;
    list += fmt::format("{}{}", list.empty() ? "" : ",", indices[i]);
    if (end > i) list += fmt::format("-{}", indices[end]);
    i = end + 1;
  }
  return list;
}

std::vector<std::string> array_words(const FarmPlan& plan, const fs::path& out,
                                     const StageChain& chain, const std::string& indices,
                                     const std::string& after) {
  const StageNeeds& needs = chain.needs;
  const std::string& first = chain.stages.front();
  std::vector<std::string> words = {
      "sbatch",
      "--parsable",
      "--requeue",           // a lost or preempted node: Slurm starts it again, it resumes
      "--open-mode=append",  // the log of its earlier starts stays
      "--signal=B:TERM@60",  // a minute before its time ends: checkpoint
      "--job-name=orbitfuse-" + first,
      "--array=" + indices,
      fmt::format("--cpus-per-task={}", needs.cores),
      fmt::format("--mem={}M", std::lround(std::ceil(needs.memory_mb))),
      fmt::format("--time={}", std::lround(std::ceil(needs.time_min))),
      "--chdir=" + out.string(),
      "--output=" + (out / ".farm" / "slurm" / (first + "-%A_%a.log")).string()};
  if (!after.empty()) {
    words.push_back("--dependency=aftercorr:" + after);
    words.push_back("--kill-on-invalid-dep=yes");  // behind a failure nothing waits for ever
  }
  const bool to_gpu = needs.gpu && !plan.slurm.gpu_partition.empty();
  const std::string& partition = to_gpu ? plan.slurm.gpu_partition : plan.slurm.partition;
  if (!partition.empty()) words.push_back("--partition=" + partition);
  if (to_gpu) words.emplace_back("--gpus=1");
  if (!plan.slurm.account.empty()) words.push_back("--account=" + plan.slurm.account);
  return words;
}

}  // namespace orbitfuse::farm
