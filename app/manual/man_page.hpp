// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <vector>

namespace orbitfuse::manual {

/// What the pages tell beside the program's own help.
struct ManualFacts {
  std::string version, date;  ///< of the release; the date as YYYY-MM-DD
  std::string introduction;   ///< docs/cli_intro.md
};

/// One page of section 1, as roff for man-db and mandoc.
struct ManPage {
  std::string name;  ///< of its file without ".1", e.g. "orbitfuse-run"
  std::string text;
};

/// The page of the program and one page a verb: names, descriptions, defaults and choices are those
/// of the command line itself, so that no page tells of an option that is not there.
std::vector<ManPage> man_pages(const CLI::App& app, const ManualFacts& facts);

/// roff of the Markdown that docs/cli_intro.md is written in: paragraphs, tables of two columns,
/// `code` and [links](where), without its title.
std::string roff_of_markdown(const std::string& markdown);

}  // namespace orbitfuse::manual
