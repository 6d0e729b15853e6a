// SPDX-License-Identifier: BSD-3-Clause
// Holds the tree to its order: which room may include which, what lies inside a module stays there,
// and sizes beyond which a folder or a function is split.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>

#include "tests/structure/function_lengths.hpp"
#include "tests/structure/source_tree.hpp"

namespace orbitfuse::structure {
namespace {

const std::string root = ORBITFUSE_SOURCE_DIR;
const std::vector<std::string> product{"core", "capture", "drivers", "recon", "fusion", "app"};

const std::vector<SourceFile>& product_sources() {
  static const std::vector<SourceFile> files = read_sources(root, product);
  return files;
}

/// What is no test.
const std::vector<SourceFile>& own_sources() {
  static const std::vector<SourceFile> files = [] {
    std::vector<std::string> folders = product;
    for (const char* more : {"bench", "examples"}) folders.emplace_back(more);
    return read_sources(root, folders);
  }();
  return files;
}

const std::vector<SourceFile>& all_sources() {
  static const std::vector<SourceFile> files = [] {
    std::vector<std::string> folders = product;
    for (const char* more : {"tests", "bench", "examples"}) folders.emplace_back(more);
    return read_sources(root, folders);
  }();
  return files;
}

/// Rooms of a module from the bottom up; those of one floor don't include each other. The headers
/// in the module's own folder lie below all of them, its other sources above.
using Floors = std::vector<std::set<std::string>>;
const std::map<std::string, Floors> floors_of{
    {"core",
     {{"http", "numeric", "radiometry", "system"},
      {"geometry"},
      {"image", "session"},
      {"formats"}}},
    {"capture", {{"clock", "guide", "image_quality"}, {"recording"}, {"live"}, {"mat", "page"}}},
    {"recon/alignment", {}},
    {"recon/assembly", {}},
    {"recon/depth", {{"stereo"}, {"ground"}}},
    {"recon/measurement", {}},
    {"recon/comparison", {}},
    {"recon/nerf", {{"kernels"}, {"field"}, {"device"}, {"rendering"}, {"training"}}},
    {"recon/poses",
     {{"features", "patches"},
      {"sfm"},
      {"cross_modal", "global_sfm"},
      {"rig"},
      {"estimate"},
      {"known"}}},
    {"recon/registration", {{"clouds", "images"}}},
    {"recon/surface", {}},
    {"fusion",
     {{"metrics", "pyramid"},
      {"training"},
      {"best", "cnn_lpif", "heat", "ms_srif", "pca_msif"},
      {"fuse"}}},
    {"app",
     {{"config", "doctor", "fusion_batch", "pipeline", "recording", "terminal"},
      {"report"},
      {"farm", "stages"},
      {"eval", "planning", "view"},
      {"export", "inspection"},
      {"comparison"},
      {"cli"},
      {"verbs"},
      {"manual"}}},
    {"drivers/aravis", {}},
    {"drivers/network", {}},
    {"drivers/replay", {}},
    {"drivers/stills", {}},
    {"drivers/synthetic", {}},
    {"drivers/usb", {}},
    {"drivers/v4l2", {}},
};

/// -1: not declared.
int floor_of(const Floors& floors, const std::string& room) {
  for (std::size_t i = 0; i < floors.size(); ++i) {
    if (floors[i].contains(room)) return static_cast<int>(i);
  }
  return -1;
}

/// "recon/nerf/field" in "recon/nerf" -> "field"; "" for the module's own folder.
std::string room_of(const std::string& folder, const std::string& module) {
  if (folder.size() <= module.size()) return "";
  const std::string inside = folder.substr(module.size() + 1);
  return inside.substr(0, inside.find('/'));
}

std::string folder_of(const std::string& path) { return path.substr(0, path.rfind('/')); }

std::string list(const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text += "  " + line + "\n";
  return text;
}

TEST(Structure, EveryRoomIsDeclared) {
  std::set<std::string> undeclared;
  for (const SourceFile& file : product_sources()) {
    const std::string module = module_of(file.folder), room = room_of(file.folder, module);
    const auto floors = floors_of.find(module);
    if (floors == floors_of.end() || (!room.empty() && floor_of(floors->second, room) < 0))
      undeclared.insert(file.folder);
  }
  EXPECT_EQ(undeclared, std::set<std::string>{}) << "say in floors_of what they may include";
}

TEST(Structure, NoFileIncludesARoomAboveIt) {
  std::vector<std::string> wrong;
  int checked = 0;
  for (const SourceFile& file : product_sources()) {
    const std::string module = module_of(file.folder), room = room_of(file.folder, module);
    const auto floors = floors_of.find(module);
    if (floors == floors_of.end()) continue;
    for (const std::string& included : file.includes) {
      const std::string other = room_of(folder_of(included), module);
      if (module_of(folder_of(included)) != module || other == room) continue;
      ++checked;
      if (other.empty()) continue;  // a header of the module's own folder
      const bool downwards = room.empty()
                                 ? !file.is_header()
                                 : floor_of(floors->second, other) < floor_of(floors->second, room);
      if (!downwards) wrong.push_back(file.path + " includes " + included);
    }
  }
  EXPECT_TRUE(wrong.empty()) << list(wrong);
  EXPECT_GT(checked, 100);
}

TEST(Structure, NoHeaderIncludesItselfByAnyWay) {
  std::map<std::string, std::vector<std::string>> edges;
  for (const SourceFile& file : all_sources()) edges[file.path] = file.includes;
  EXPECT_TRUE(find_circle(edges).empty()) << list(find_circle(edges));
}

/// Folders that belong to their module alone, and whose tests and benchmarks may look inside.
bool is_internal(const std::string& folder) {
  const std::string module = module_of(folder), room = room_of(folder, module);
  if (module.starts_with("recon/")) return !room.empty();
  return module == "fusion" && room != "fuse" && room != "heat" && room != "metrics";
}

TEST(Structure, RoomsInsideAModuleAreItsOwn) {
  std::vector<std::string> wrong;
  for (const SourceFile& file : all_sources()) {
    const std::string from = file.folder;
    for (const std::string& included : file.includes) {
      const std::string module = module_of(folder_of(included));
      if (!is_internal(folder_of(included)) || module_of(from) == module) continue;
      const std::string name = module.substr(module.rfind('/') + 1);
      const bool looks_inside = from == "tests/support" || from.starts_with("tests/" + module) ||
                                from.starts_with("bench/" + name) ||
                                (module == "fusion" && from.starts_with("bench/cnn_lpif"));
      if (!looks_inside) wrong.push_back(file.path + " includes " + included);
    }
  }
  EXPECT_TRUE(wrong.empty()) << list(wrong);
}

TEST(Structure, NobodyBuildsOnWhatIsAboveIt) {
  // Nothing depends on what measures or shows the product, and the product on no test.
  std::vector<std::string> wrong;
  const auto of = [](const std::string& path, const char* folder) {
    return path.starts_with(std::string(folder) + "/");
  };
  for (const SourceFile& file : all_sources()) {
    for (const std::string& included : file.includes) {
      const bool measures = of(included, "bench") && !of(file.path, "bench");
      const bool shows = of(included, "examples") && !of(file.path, "examples");
      const bool tests =
          of(included, "tests") && !of(file.path, "tests") && !of(file.path, "bench");
      if (measures || shows || tests) wrong.push_back(file.path + " includes " + included);
    }
  }
  EXPECT_TRUE(wrong.empty()) << list(wrong);
}

TEST(Structure, NoFolderHoldsMoreThanTwentyFiveFilesOfAKind) {
  namespace fs = std::filesystem;
  std::map<std::string, int> files;
  std::vector<std::string> folders = product;
  for (const char* more : {"tests", "bench", "examples", "docs", "cmake", "config"})
    folders.emplace_back(more);
  for (const std::string& folder : folders) {
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(root) / folder)) {
      if (entry.is_regular_file())
        ++files[entry.path().parent_path().string() + " " + entry.path().extension().string()];
    }
  }
  for (const auto& [kind, count] : files) EXPECT_LE(count, 25) << kind;
}

TEST(Structure, NoTwoTypesShareAName) {
  // A type of an inner namespace that is named as one of `orbitfuse` hides it there, and a reader
  // who sees the name takes one for the other.
  std::map<std::string, std::vector<std::string>> places;
  for (const SourceFile& file : own_sources()) {
    if (!file.is_header()) continue;
    for (const std::string& type : types_of(file)) places[type].push_back(file.path);
  }
  std::vector<std::string> wrong;
  for (const auto& [type, where] : places) {
    if (where.size() > 1) wrong.push_back(type + ": " + where[0] + ", " + where[1]);
    const std::string outer = "orbitfuse" + type.substr(type.rfind("::"));
    if (const auto hidden = places.find(outer); outer != type && hidden != places.end())
      wrong.push_back(type + " in " + where[0] + " hides that of " + hidden->second[0]);
  }
  EXPECT_TRUE(wrong.empty()) << list(wrong);
  EXPECT_GT(places.size(), 200u);
}

TEST(Structure, NoTwoHeadersOfANamespaceShareAName) {
  std::map<std::string, std::set<std::string>> places;  // by namespace and file name
  for (const SourceFile& file : own_sources()) {
    if (!file.is_header()) continue;
    const std::size_t start = file.text.find("\nnamespace ");
    if (start == std::string::npos) continue;
    const std::string space =
        file.text.substr(start + 11, file.text.find(' ', start + 11) - start - 11);
    places[space + " " + file.name].insert(file.path);
  }
  for (const auto& [name, where] : places) {
    EXPECT_EQ(where.size(), 1u) << name << ":\n" << list({where.begin(), where.end()});
  }
}

TEST(Structure, ExamplesFitOnAScreen) {
  for (const SourceFile& file : read_sources(root, {"examples"}))
    EXPECT_LT(std::count(file.text.begin(), file.text.end(), '\n'), 40) << file.path;
}

TEST(Structure, FunctionsStayUnderAHundredLines) {
  std::vector<std::string> wrong;
  int functions = 0;
  for (const SourceFile& file : own_sources()) {
    for (const Function& function : functions_of(file.text)) {
      ++functions;
      if (function.lines < 100) continue;
      wrong.push_back(file.path + ":" + std::to_string(function.first_line) + " " + function.head +
                      ": " + std::to_string(function.lines) + " lines");
    }
  }
  EXPECT_TRUE(wrong.empty()) << list(wrong);
  EXPECT_GT(functions, 1500);
}

TEST(Structure, FunctionsAreFoundAndMeasured) {
  const auto found = functions_of(R"code(namespace a {
// { not code
struct Point {
  int x = 0;
  bool good() const { return x > 0; }
};
const std::map<int, int> table{{1, 2}};
Point::Point(int v) : x(v), y{v} {
  f("}");
}
auto g(int i = int{3}) -> std::vector<int> {
  const auto inner = [&] {
    return '{';
  };
  return {};
}
}  // namespace a
)code");
  ASSERT_EQ(found.size(), 3u);
  EXPECT_EQ(found[0].head, "bool good() const");
  EXPECT_EQ(found[0].lines, 1);
  EXPECT_EQ(found[1].first_line, 8);
  EXPECT_EQ(found[1].lines, 3);
  EXPECT_EQ(found[2].lines, 6);
}

TEST(Structure, CirclesAreFound) {
  EXPECT_TRUE(find_circle({{"a", {"b"}}, {"b", {"c"}}, {"c", {}}}).empty());
  EXPECT_EQ(find_circle({{"a", {"b"}}, {"b", {"c"}}, {"c", {"b"}}}),
            (std::vector<std::string>{"b", "c", "b"}));
}

}  // namespace
}  // namespace orbitfuse::structure
