// SPDX-License-Identifier: BSD-3-Clause
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>

#include "app/cli/command_line.hpp"
#include "app/manual/completion.hpp"
#include "app/manual/man_page.hpp"
#include "app/pipeline/runner.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::manual {
namespace {

Status write_all(const std::filesystem::path& folder, const std::string& introduction,
                 const std::string& date) {
  ManualFacts facts{.version = pipeline::software_version(), .date = date, .introduction = {}};
  ORBITFUSE_ASSIGN(facts.introduction, read_file(introduction));
  const cli::CommandLine line;
  for (const ManPage& page : man_pages(line.app, facts))
    ORBITFUSE_TRY(write_file_atomic(folder / "man" / (page.name + ".1"), page.text));
  return write_file_atomic(folder / "completion" / "orbitfuse", bash_completion(line.app));
}

}  // namespace
}  // namespace orbitfuse::manual

/// orbitfuse_write_manual build/manual docs/cli_intro.md 2026-11-23
int main(int argc, char** argv) {
  std::string folder, introduction, date;
  CLI::App app("Writes man/*.1 and completion/orbitfuse into a folder that has both folders.");
  app.add_option("folder", folder)->required();
  app.add_option("introduction", introduction, "docs/cli_intro.md")->required();
  app.add_option("date", date, "of the release, YYYY-MM-DD")->required();
  CLI11_PARSE(app, argc, argv);
  const auto status = orbitfuse::manual::write_all(folder, introduction, date);
  if (status) return 0;
  std::fprintf(stderr, "%s\n", status.error().message().c_str());
  return 3;
}
