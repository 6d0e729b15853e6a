// SPDX-License-Identifier: BSD-3-Clause
#include "app/export/glb.hpp"

#include <tiny_gltf.h>

#include <Eigen/Geometry>

#include <cmath>
#include <cstring>
#include <limits>
#include <sstream>

#include "core/system/file_io.hpp"

namespace orbitfuse::exporting {
namespace {

tinygltf::Value value_of(const nlohmann::json& j) {
  if (j.is_boolean()) return tinygltf::Value(j.get<bool>());
  if (j.is_number_integer()) return tinygltf::Value(j.get<int>());
  if (j.is_number()) return tinygltf::Value(j.get<double>());
  if (j.is_string()) return tinygltf::Value(j.get<std::string>());
  if (j.is_array()) {
    tinygltf::Value::Array list;
    for (const auto& item : j) list.push_back(value_of(item));
    return tinygltf::Value(std::move(list));
  }
  tinygltf::Value::Object object;
  if (j.is_object())
    for (const auto& [key, item] : j.items())
      if (!item.is_null()) object[key] = value_of(item);
  return tinygltf::Value(std::move(object));
}

std::uint16_t linear_of_srgb(std::uint8_t level) {
  const double s = level / 255.0;
  const double linear = s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
  return static_cast<std::uint16_t>(std::lround(65535 * linear));
}

std::uint8_t srgb_of_linear(std::uint16_t level) {
  const double linear = level / 65535.0;
  const double s = linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
  return static_cast<std::uint8_t>(std::lround(255 * s));
}

template <class Vector>
std::array<float, 3> y_up(const Vector& v) {
  return {static_cast<float>(v[0]), static_cast<float>(v[2]), static_cast<float>(-v[1])};
}

/// One buffer, a view and an accessor for each array that is added.
class Builder {
 public:
  tinygltf::Model model;

  Builder() { model.buffers.emplace_back(); }

  template <class Item>
  int add(const std::vector<Item>& items, int component, int type, int target,
          bool normalized = false) {
    auto& data = model.buffers[0].data;
    tinygltf::BufferView view;
    view.buffer = 0;
    view.byteOffset = data.size();
    view.byteLength = items.size() * sizeof(Item);
    view.target = target;
    data.resize(data.size() + (view.byteLength + 3) / 4 * 4);
    std::memcpy(data.data() + view.byteOffset, items.data(), view.byteLength);
    model.bufferViews.push_back(view);
    tinygltf::Accessor accessor;
    accessor.bufferView = static_cast<int>(model.bufferViews.size()) - 1;
    accessor.componentType = component;
    accessor.type = type;
    accessor.normalized = normalized;
    accessor.count = items.size() * sizeof(Item) /
                     static_cast<std::size_t>(
                         tinygltf::GetComponentSizeInBytes(static_cast<std::uint32_t>(component)) *
                         tinygltf::GetNumComponentsInType(static_cast<std::uint32_t>(type)));
    model.accessors.push_back(accessor);
    return static_cast<int>(model.accessors.size()) - 1;
  }
};

tinygltf::Primitive primitive_of(const TriangleMesh& mesh, const std::vector<VertexScalar>& scalars,
                                 Builder& builder) {
  const PointCloud& v = mesh.vertices;
  constexpr int of_vertices = TINYGLTF_TARGET_ARRAY_BUFFER;
  tinygltf::Primitive p;
  p.mode = TINYGLTF_MODE_TRIANGLES;
  p.material = 0;
  std::vector<std::array<float, 3>> list;
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3d& x : v.positions) {
    list.push_back(y_up(x));
    box.extend(Eigen::Vector3f(list.back().data()));
  }
  p.attributes["POSITION"] =
      builder.add(list, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3, of_vertices);
  for (int d = 0; d < 3; ++d) {
    builder.model.accessors.back().minValues.push_back(static_cast<double>(box.min()[d]));
    builder.model.accessors.back().maxValues.push_back(static_cast<double>(box.max()[d]));
  }
  if (!v.normals.empty()) {
    list.clear();
    for (const Eigen::Vector3f& n : v.normals)  // glTF wants unit length
      list.push_back(y_up(n.squaredNorm() > 0.5F ? n : Eigen::Vector3f(Eigen::Vector3f::UnitZ())));
    p.attributes["NORMAL"] =
        builder.add(list, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3, of_vertices);
  }
  if (!v.colors.empty()) {
    std::vector<std::array<std::uint16_t, 4>> rgba;  // four: each vertex begins at a multiple of 4
    for (const auto& c : v.colors)
      rgba.push_back({linear_of_srgb(c[0]), linear_of_srgb(c[1]), linear_of_srgb(c[2]), 65535});
    p.attributes["COLOR_0"] = builder.add(rgba, TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT,
                                          TINYGLTF_TYPE_VEC4, of_vertices, true);
  }
  const auto add_scalar = [&](const std::string& name, std::vector<float> values) {
    for (float& value : values)
      if (!std::isfinite(value)) value = 0;
    p.attributes[name] =
        builder.add(values, TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_SCALAR, of_vertices);
  };
  if (!v.temperatures_k.empty()) add_scalar("_TEMPERATURE", v.temperatures_k);
  for (const VertexScalar& scalar : scalars) add_scalar(scalar.name, scalar.values);
  p.indices = builder.add(mesh.triangles, TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT,
                          TINYGLTF_TYPE_SCALAR, TINYGLTF_TARGET_ELEMENT_ARRAY_BUFFER);
  return p;
}

/// The items of an accessor; none where the file has no such ones.
template <class Item>
std::vector<Item> items_of(const tinygltf::Model& model, int accessor, int component, int type) {
  const auto at = static_cast<std::size_t>(accessor);
  if (accessor < 0 || at >= model.accessors.size() || model.buffers.empty()) return {};
  const tinygltf::Accessor& a = model.accessors[at];
  const auto of = static_cast<std::size_t>(a.bufferView);
  if (a.componentType != component || a.type != type || a.byteOffset != 0 || a.bufferView < 0 ||
      of >= model.bufferViews.size())
    return {};
  const tinygltf::BufferView& view = model.bufferViews[of];
  const auto& data = model.buffers[0].data;
  if (view.buffer != 0 || view.byteStride != 0 || view.byteOffset > data.size() ||
      view.byteLength > data.size() - view.byteOffset)
    return {};
  std::vector<Item> items(view.byteLength / sizeof(Item));
  std::memcpy(items.data(), data.data() + view.byteOffset, items.size() * sizeof(Item));
  return items;
}

}  // namespace

Status write_glb(const std::filesystem::path& path, const TriangleMesh& mesh,
                 const nlohmann::json& extras, const std::vector<VertexScalar>& scalars) {
  if (mesh.empty())
    return fail(ErrorKind::input, path.string(), "a mesh without triangles", "choose a larger box");
  for (const Eigen::Vector3d& p : mesh.vertices.positions)
    if (!p.allFinite())
      return fail(ErrorKind::input, path.string(), "a vertex that is not finite",
                  "leave such vertices out");
  for (const VertexScalar& scalar : scalars)
    if (scalar.values.size() != mesh.vertices.size())
      return fail(ErrorKind::input, path.string(), scalar.name + " that is not one a vertex",
                  "give each vertex a value");
  Builder builder;
  tinygltf::Model& model = builder.model;
  model.asset.version = "2.0";
  model.asset.generator = "OrbitFuse";
  model.asset.extras = value_of(extras);
  tinygltf::Material material;
  material.name = "as recorded";
  material.doubleSided = true;
  material.pbrMetallicRoughness.metallicFactor = 0;
  material.pbrMetallicRoughness.roughnessFactor = 1;
  material.extensions["KHR_materials_unlit"] = tinygltf::Value(tinygltf::Value::Object());
  model.materials.push_back(material);
  model.extensionsUsed.emplace_back("KHR_materials_unlit");
  tinygltf::Mesh shape;
  shape.name = "surface";
  shape.extras = model.asset.extras;
  shape.primitives.push_back(primitive_of(mesh, scalars, builder));
  model.meshes.push_back(shape);
  tinygltf::Node node;
  node.name = "surface";
  node.mesh = 0;
  model.nodes.push_back(node);
  tinygltf::Scene scene;
  scene.nodes.push_back(0);
  model.scenes.push_back(scene);
  model.defaultScene = 0;
  std::ostringstream bytes;
  tinygltf::TinyGLTF writer;
  if (!writer.WriteGltfSceneToStream(&model, bytes, false, true))
    return fail(ErrorKind::input, path.string(), "more than a GLB holds (4 GiB)",
                "ask for fewer --triangles");
  return write_file_atomic(path, bytes.str());
}

Result<TriangleMesh> read_glb(const std::filesystem::path& path) {
  const auto wrong = [&](const std::string& found) {
    return fail(ErrorKind::input, path.string(), found, "export the surface again");
  };
  ORBITFUSE_ASSIGN(const std::string bytes, read_file(path));
  tinygltf::Model model;
  std::string error, warning;
  if (!tinygltf::TinyGLTF().LoadBinaryFromMemory(
          &model, &error, &warning, reinterpret_cast<const unsigned char*>(bytes.data()),
          static_cast<unsigned>(bytes.size())))
    return wrong("no GLB, or cut");
  if (model.meshes.size() != 1 || model.meshes[0].primitives.size() != 1)
    return wrong("not one surface");
  const tinygltf::Primitive& p = model.meshes[0].primitives[0];
  const auto accessor = [&](const char* name) {
    const auto found = p.attributes.find(name);
    return found == p.attributes.end() ? -1 : found->second;
  };
  TriangleMesh mesh;
  PointCloud& v = mesh.vertices;
  for (const auto& x : items_of<std::array<float, 3>>(
           model, accessor("POSITION"), TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_VEC3))
    v.positions.emplace_back(x[0], -x[2], x[1]);
  for (const auto& c : items_of<std::array<std::uint16_t, 4>>(
           model, accessor("COLOR_0"), TINYGLTF_COMPONENT_TYPE_UNSIGNED_SHORT, TINYGLTF_TYPE_VEC4))
    v.colors.push_back({srgb_of_linear(c[0]), srgb_of_linear(c[1]), srgb_of_linear(c[2])});
  for (const float k : items_of<float>(model, accessor("_TEMPERATURE"),
                                       TINYGLTF_COMPONENT_TYPE_FLOAT, TINYGLTF_TYPE_SCALAR))
    v.temperatures_k.push_back(k > 0 ? k : std::numeric_limits<float>::quiet_NaN());
  mesh.triangles = items_of<std::array<std::uint32_t, 3>>(
      model, p.indices, TINYGLTF_COMPONENT_TYPE_UNSIGNED_INT, TINYGLTF_TYPE_SCALAR);
  for (const std::size_t count : {v.colors.size(), v.temperatures_k.size()})
    if (count != 0 && count != v.size()) return wrong("an attribute that is not one a vertex");
  for (const auto& triangle : mesh.triangles)
    for (const std::uint32_t corner : triangle)
      if (corner >= v.size()) return wrong("a triangle with a corner that is none of its vertices");
  if (mesh.empty()) return wrong("no triangles");
  return mesh;
}

}  // namespace orbitfuse::exporting
