// SPDX-License-Identifier: BSD-3-Clause
#include "tests/app/cli/small_run.hpp"

#include <gtest/gtest.h>

#include <map>

#include "tests/app/cli/program.hpp"
#include "tests/app/cli/session_fixture.hpp"
#include "tests/support/temp_folder.hpp"

namespace orbitfuse {

std::vector<std::string> small_run(const std::filesystem::path& session,
                                   const std::filesystem::path& out) {
  std::vector<std::string> words = {"run", session.string(), "--out", out.string()};
  for (const std::string modality : {"visible", "thermal"})
    for (const char* set : {"iterations=300", "eval_count=0", "log2_table=13", "cloud_width_px=32"})
      words.insert(words.end(), {"--set", "train." + modality + "." + set});
  for (const char* set : {"render.views=2", "render.width_px=64", "fuse.methods=[\"heat\"]"})
    words.insert(words.end(), {"--set", set});
  return words;
}

const MadeRun& made_run(double warmer_k) {
  static const test::TempFolder folder;
  static std::map<double, MadeRun> runs;
  const auto [found, is_new] = runs.try_emplace(warmer_k);
  MadeRun& made = found->second;
  if (!is_new) return made;
  const auto place = folder / std::to_string(runs.size());
  made = {place / "session", place / "out"};
  FixtureOptions options;
  options.warmer_k = warmer_k;
  write_fixture_session(made.session, options);
  const Outcome run = orbitfuse_program(small_run(made.session, made.out));
  EXPECT_EQ(run.code, 0) << run.err;
  return made;
}

void copy_results(const MadeRun& run, const std::filesystem::path& to) {
  std::filesystem::copy(run.out, to, std::filesystem::copy_options::recursive);
}

}  // namespace orbitfuse
