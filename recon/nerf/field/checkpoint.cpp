// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/field/checkpoint.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "core/system/file_io.hpp"
#include "core/system/parallel.hpp"
#include "core/system/trace.hpp"
#include "recon/nerf/nerf.hpp"

// Layout: magic, version, then tagless values in the order of `visit`, then the hash of all bytes
// before it. Little-endian, as every machine this project runs on.
namespace orbitfuse::nerf {
namespace {

constexpr char magic[8] = {'O', 'F', 'N', 'E', 'R', 'F', '0', '5'};  // the last two: version
constexpr std::size_t hash_length = 32;

class Writer {
 public:
  static constexpr bool reading = false, ok = true;
  std::string bytes{magic, sizeof magic};
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void operator()(T& value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); }
  template <class T>
  void operator()(std::vector<T>& values) {
    std::uint64_t count = values.size();
    (*this)(count);
    bytes.append(reinterpret_cast<const char*>(values.data()), count * sizeof(T));
  }
  void operator()(std::string& text) {
    std::uint64_t count = text.size();
    (*this)(count);
    bytes += text;
  }
};

class Reader {
 public:
  static constexpr bool reading = true;
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}
  bool ok = true;
  std::string problem = "malformed content";  ///< what to say when not ok
  void refuse(std::string why) {
    if (ok) problem = std::move(why);
    ok = false;
  }
  template <class T>
  requires std::is_trivially_copyable_v<T>
  void operator()(T& value) { take(&value, sizeof value); }
  // Not every byte is a value of these.
  void operator()(bool& value) {
    std::uint8_t byte = 0;
    take(&byte, sizeof byte);
    if (byte > 1) refuse("a flag that is neither 0 nor 1");
    value = byte == 1;
  }
  void operator()(Modality& value) {
    std::underlying_type_t<Modality> number = 0;
    take(&number, sizeof number);
    if (number < 0 || number > static_cast<int>(Modality::thermal)) refuse("an unknown modality");
    value = number == 0 ? Modality::visible : Modality::thermal;
  }
  template <class T>
  void operator()(std::vector<T>& values) {
    std::uint64_t count = 0;
    (*this)(count);
    if (!ok || count > bytes_.size() / sizeof(T)) return void(ok = false);
    values.resize(count);
    take(values.data(), count * sizeof(T));
  }
  void operator()(std::string& text) {
    std::uint64_t count = 0;
    (*this)(count);
    if (!ok || count > bytes_.size()) return void(ok = false);
    text.assign(bytes_.substr(0, count));
    bytes_.remove_prefix(count);
  }
  bool at_end() const { return ok && bytes_.empty(); }
  std::size_t remaining() const { return bytes_.size(); }

 private:
  void take(void* to, std::size_t size) {
    if (!ok || bytes_.size() < size) return void(ok = false);
    if (size > 0) std::memcpy(to, bytes_.data(), size);
    bytes_.remove_prefix(size);
  }
  std::string_view bytes_;
};

/// Keys with their values. An option that the file lacks keeps its default: a field outlives the
/// program that made it. An option that this program doesn't know might change what the parameters
/// mean.
template <class Archive>
void visit_options(Archive& io, TrainOptions& options) {
  const std::vector<std::string> keys = TrainOptions::keys();
  std::uint64_t count = keys.size();
  io(count);
  for (std::uint64_t i = 0; io.ok && i < count; ++i) {
    std::string key = i < keys.size() ? keys[i] : std::string(), value = options.get(key);
    io(key);
    io(value);
    if constexpr (Archive::reading) {
      if (io.ok && std::find(keys.begin(), keys.end(), key) == keys.end())
        io.refuse(fmt::format("it has the option nerf.{}, unknown to this program", key));
      if (const Status set = io.ok ? options.set(key, value) : Status(); !set)
        io.refuse(fmt::format("its option nerf.{} is '{}'", key, value));
    }
  }
}

template <class Archive>
void visit(Archive& io, Parameters& p) {
  const std::size_t count = p.size();
  for (std::vector<float>* part : {&p.value, &p.first, &p.second}) {
    io(*part);
    if constexpr (Archive::reading) io.ok = io.ok && part->size() == count;
  }
}

/// In a file as Parameters.
template <class Archive>
void visit(Archive& io, GridTable& table) {
  for (const GridTable::Part part : {&GridLine::value, &GridLine::first, &GridLine::second}) {
    std::vector<float> numbers;
    if constexpr (!Archive::reading) numbers = table.part(part);
    io(numbers);
    if constexpr (Archive::reading) {
      io.ok = io.ok && numbers.size() == table.size();
      if (io.ok) table.set_part(part, numbers);
    }
  }
}

/// The occupancy's densities matter only for cells that are on.
template <class Archive>
void visit(Archive& io, Occupancy& grid) {
  io(grid.on);
  io(grid.allowed);
  std::vector<float> dense;
  if constexpr (!Archive::reading) {
    for (std::int64_t c = 0; c < grid.cell_count(); ++c)
      if (grid.density[static_cast<std::size_t>(c)] > 0)
        dense.push_back(grid.density[static_cast<std::size_t>(c)]);
  }
  std::vector<std::uint64_t> set((grid.density.size() + 63) / 64);
  if constexpr (!Archive::reading)
    for (std::int64_t c = 0; c < grid.cell_count(); ++c)
      if (grid.density[static_cast<std::size_t>(c)] > 0) Occupancy::put(set, c, true);
  io(set);
  io(dense);
  io(grid.visited);
  std::vector<float> window;
  if constexpr (!Archive::reading)
    for (const std::int64_t c : grid.visited)
      window.push_back(grid.window[static_cast<std::size_t>(c)]);
  io(window);
  if constexpr (Archive::reading) {
    const std::size_t words = (grid.density.size() + 63) / 64;
    io.ok = io.ok && set.size() == words && grid.on.size() == words &&
            grid.allowed.size() == words && window.size() == grid.visited.size();
    if (!io.ok) return;
    std::size_t next = 0;
    for (std::int64_t c = 0; c < grid.cell_count() && next < dense.size(); ++c)
      if (Occupancy::test(set, c)) grid.density[static_cast<std::size_t>(c)] = dense[next++];
    for (std::size_t i = 0; i < window.size(); ++i) {
      if (grid.visited[i] < 0 || grid.visited[i] >= grid.cell_count()) return void(io.ok = false);
      grid.window[static_cast<std::size_t>(grid.visited[i])] = window[i];
    }
    grid.refresh();
  }
}

template <class Archive>
void visit(Archive& io, std::vector<std::vector<float>>& lists) {
  std::uint64_t count = lists.size();
  io(count);
  if constexpr (Archive::reading) {
    if (count > 64) return void(io.ok = false);
    lists.resize(count);
  }
  for (std::vector<float>& list : lists) io(list);
}

template <class Archive>
void visit(Archive& io, History& history) {
  io(history.curve);
  io(history.skipped_steps);
  io(history.rays);
  io(history.samples);
  io(history.cpu_s);
  io(history.wall_s);
}

template <class Archive>
void visit(Archive& io, std::vector<ViewRecord>& views) {
  std::uint64_t count = views.size();
  io(count);
  if constexpr (Archive::reading) {
    constexpr std::size_t least_bytes = 17;  // two empty texts and a flag
    if (!io.ok || count > io.remaining() / least_bytes) return void(io.ok = false);
    views.resize(count);
  }
  for (ViewRecord& view : views) {
    io(view.name);
    io(view.heldout);
    io(view.hash);
  }
}

template <class Archive>
void visit(Archive& io, Snapshot& best) {
  io(best.step);
  io(best.psnr);
  io(best.occupied);
  visit(io, best.values);
  io(best.codes);
  visit(io, best.level_weights);
  io(best.poses);
}

bool fits(const Snapshot& best, FieldState& state) {
  std::vector<std::size_t> sizes, kept;
  state.each_set([&](const auto& set) { sizes.push_back(set.size()); });
  for (const std::vector<float>& values : best.values) kept.push_back(values.size());
  const auto networks = state.density_networks();
  bool same = kept == sizes && best.level_weights.size() == networks.size() &&
              best.poses.size() == state.refined_poses.size() &&
              best.occupied.size() == state.occupancy.on.size() &&
              best.codes.size() == state.occupancy.code.size();
  for (std::size_t i = 0; same && i < networks.size(); ++i)
    same = best.level_weights[i].size() == networks[i]->grid.level_weight.size();
  return same;
}

/// What the largest parts take in a file: asked before memory is taken for them.
std::size_t least_size(const TrainOptions& options) {
  HashEncoding grid;
  const auto entries = static_cast<std::size_t>(
      grid.lay_out(options.levels, options.features_per_level, options.log2_table,
                   options.base_resolution, options.max_resolution));
  const auto cells = static_cast<std::size_t>(options.occupancy_resolution);
  return 3 * sizeof(float) * entries + 3 * occupancy_cascades * cells * cells * cells / 8;
}

template <class Archive>
void visit(Archive& io, FieldState& state) {
  visit_options(io, state.options);
  io(state.modality);
  visit(io, state.views);
  if constexpr (Archive::reading) {
    if (!io.ok) return;
    if (const Status valid = state.options.validate(); !valid)
      return io.refuse(valid.error().message());
    if (io.remaining() < least_size(state.options)) return io.refuse("cut short");
    state.create(state.options, state.modality, static_cast<int>(state.views.size()));
  }
  io(state.thermal_is_gray);
  double center[3] = {state.space.center.x(), state.space.center.y(), state.space.center.z()};
  io(center);
  state.space.center = {center[0], center[1], center[2]};
  io(state.space.radius);
  io(state.span);
  io(state.step);
  io(state.rays_per_step);
  io(state.train_psnr);
  io(state.samples_per_ray);
  visit(io, state.history);
  io(state.refined_poses);
  for (DensityNetwork* network : state.density_networks()) io(network->grid.level_weight);
  state.each_set([&](auto& set) { visit(io, set); });
  visit(io, state.occupancy);
  visit(io, state.best);
  if constexpr (Archive::reading) {
    io.ok = io.ok && (state.best.empty() || fits(state.best, state)) &&
            state.refined_poses.size() == (state.options.refine_poses ? state.views.size() : 0);
  }
}

}  // namespace

Status save_state(const FieldState& state, const std::filesystem::path& path) {
  const TraceSpan span("write a field");
  Writer writer;
  visit(writer, const_cast<FieldState&>(state));  // the writing archive only reads
  const std::string hash = content_hash(writer.bytes);
  writer.bytes += hash;
  return write_file_atomic(path, writer.bytes);
}

Result<FieldState> load_state(const std::filesystem::path& path) {
  const TraceSpan span("read a field");
  ORBITFUSE_ASSIGN(const std::string bytes, read_file(path));
  const auto bad = [&](std::string found) {
    return fail(ErrorKind::input, path.string(), std::move(found),
                "delete it and train again, or restore a copy");
  };
  if (bytes.size() < sizeof magic + hash_length)
    return bad(fmt::format("cut short: {} bytes", bytes.size()));
  if (std::memcmp(bytes.data(), magic, sizeof magic - 2) != 0) return bad("not a field");
  if (std::memcmp(bytes.data(), magic, sizeof magic) != 0)
    return bad("a field of another version of this program");
  const std::string_view body(bytes.data(), bytes.size() - hash_length);
  if (content_hash(body) != bytes.substr(body.size()))
    return bad("checksum differs: cut or altered");
  Reader reader(body.substr(sizeof magic));
  FieldState state;
  visit(reader, state);
  if (!reader.at_end()) return bad(reader.problem);
  state.refresh();
  return state;
}

std::vector<ViewRecord> records_of(const Dataset& dataset, const std::vector<bool>& heldout) {
  std::vector<ViewRecord> records(dataset.views.size());
  parallel_for(static_cast<int>(records.size()), [&](int index) {
    const auto i = static_cast<std::size_t>(index);
    const TrainingView& view = dataset.views[i];
    const cv::Mat image = view.image.isContinuous() ? view.image : view.image.clone();
    const Camera& c = view.camera;
    const Eigen::Quaterniond& q = view.cam_from_world.rotation;
    const Eigen::Vector3d& t = view.cam_from_world.translation;
    const double width = c.width, height = c.height;
    const double where[] = {width, height, c.fx,  c.fy,  c.cx,  c.cy,  c.k1,  c.k2, c.p1,
                            c.p2,  q.w(),  q.x(), q.y(), q.z(), t.x(), t.y(), t.z()};
    const std::string pixels =
        content_hash({reinterpret_cast<const char*>(image.data), image.total() * image.elemSize()});
    const std::string_view placed(reinterpret_cast<const char*>(where), sizeof where);
    records[i] = {view.name, heldout[i], content_hash(std::string(placed) + pixels)};
  });
  return records;
}

Status check_resumable(const FieldState& state, const Dataset& dataset,
                       const std::vector<ViewRecord>& views, const TrainOptions& options) {
  const auto differs = [&](const std::string& found) {
    return fail(ErrorKind::input, options.checkpoint.string(), found,
                "go on with the same data and options, or delete it to start afresh");
  };
  if (state.modality != dataset.modality) return differs("made with another modality");
  if (state.thermal_is_gray != dataset.thermal_is_gray)
    return differs("made with another unit of thermal samples");
  for (const std::string& key : TrainOptions::keys())
    if (!TrainOptions::free_to_change(key) && state.options.get(key) != options.get(key))
      return differs(fmt::format("made with nerf.{} = {}, not {}", key, state.options.get(key),
                                 options.get(key)));
  if (state.views.size() != views.size())
    return differs(fmt::format("made with {} views, not {}", state.views.size(), views.size()));
  for (std::size_t i = 0; i < views.size(); ++i) {
    const ViewRecord &then = state.views[i], &now = views[i];
    if (then.name != now.name)
      return differs(fmt::format("view {} was {}, not {}", i, then.name, now.name));
    if (then.heldout != now.heldout)
      return differs(
          fmt::format("made with {} {}", now.name, then.heldout ? "held out" : "training"));
    if (then.hash != now.hash)
      return differs("made with another image, camera or pose of " + now.name);
  }
  return {};
}

Result<Field> Field::load(const std::filesystem::path& path) {
  ORBITFUSE_ASSIGN(FieldState state, load_state(path));
  return Field(std::make_unique<FieldState>(std::move(state)));
}

Status save_checkpoint(Field finished, const TrainReport& report,
                       const std::filesystem::path& checkpoint) {
  if (finished.empty())
    return fail(ErrorKind::input, "field", "it is empty", "train or load it first");
  FieldState& state = finished.state();
  state.history = report;
  if (state.options.keep_best && std::isfinite(report.best_psnr)) {
    state.best = state.snapshot(report.best_psnr);
    state.best.step = report.best_step;
  }
  return save_state(state, checkpoint);
}

Status Field::save(const std::filesystem::path& path) const {
  if (!state_) return fail(ErrorKind::input, "field", "it is empty", "train or load it first");
  return save_state(*state_, path);
}

}  // namespace orbitfuse::nerf
