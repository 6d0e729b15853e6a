// SPDX-License-Identifier: BSD-3-Clause
#include "tests/structure/source_tree.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <regex>
#include <set>
#include <sstream>

namespace orbitfuse::structure {
namespace {

namespace fs = std::filesystem;

SourceFile read_source(const fs::path& root, const fs::path& path) {
  SourceFile file;
  file.path = path.lexically_relative(root).generic_string();
  file.folder = fs::path(file.path).parent_path().generic_string();
  file.name = path.filename().string();
  std::ifstream in(path);
  const std::string quote = "#include \"";
  for (std::string line; std::getline(in, line);) {
    file.text += line + '\n';
    if (!line.starts_with(quote)) continue;
    const std::string included = line.substr(quote.size(), line.rfind('"') - quote.size());
    if (fs::exists(root / included)) file.includes.push_back(included);
  }
  return file;
}

}  // namespace

std::vector<SourceFile> read_sources(const std::string& root,
                                     const std::vector<std::string>& folders) {
  std::vector<SourceFile> files;
  for (const std::string& folder : folders) {
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(root) / folder)) {
      const std::string extension = entry.path().extension().string();
      if (entry.is_regular_file() && (extension == ".cpp" || extension == ".hpp"))
        files.push_back(read_source(root, entry.path()));
    }
  }
  std::sort(files.begin(), files.end(),
            [](const auto& a, const auto& b) { return a.path < b.path; });
  return files;
}

std::string module_of(const std::string& folder) {
  const std::size_t first = folder.find('/');
  const std::string top = folder.substr(0, first);
  if (first == std::string::npos || (top != "recon" && top != "drivers" && top != "bench"))
    return top;
  return folder.substr(0, folder.find('/', first + 1));
}

std::vector<std::string> types_of(const SourceFile& file) {
  static const std::regex opens(R"(^namespace ([\w:]+) \{)"),
      defines(R"(^(?:struct|class|enum class|enum) (\w+)(?: final)?(?: :.*| \{.*)$)");
  std::vector<std::string> types;
  std::string space;
  std::istringstream lines(file.text);
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    if (std::regex_search(line, match, opens)) {
      space = space.empty() ? match[1].str() : space + "::" + match[1].str();
    } else if (line.starts_with("}  // namespace ")) {
      const std::string closed = line.substr(16);
      space = space.size() > closed.size() ? space.substr(0, space.size() - closed.size() - 2) : "";
    } else if (std::regex_search(line, match, defines)) {
      types.push_back(space + "::" + match[1].str());
    }
  }
  return types;
}

std::vector<std::string> find_circle(const std::map<std::string, std::vector<std::string>>& edges) {
  std::set<std::string> finished;
  std::vector<std::string> path;
  const std::function<bool(const std::string&)> visit = [&](const std::string& node) {
    const auto seen = std::find(path.begin(), path.end(), node);
    if (seen != path.end()) {
      path.erase(path.begin(), seen);
      path.push_back(node);
      return true;
    }
    if (finished.contains(node)) return false;
    path.push_back(node);
    if (const auto next = edges.find(node); next != edges.end()) {
      for (const std::string& to : next->second) {
        if (visit(to)) return true;
      }
    }
    path.pop_back();
    finished.insert(node);
    return false;
  };
  for (const auto& [node, next] : edges) {
    if (visit(node)) return path;
  }
  return {};
}

}  // namespace orbitfuse::structure
