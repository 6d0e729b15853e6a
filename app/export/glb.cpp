// SPDX-License-Identifier: BSD-3-Clause
#include "app/export/glb.hpp"

#include <tiny_gltf.h>

#include <Eigen/Geometry>

#include <cmath>
#include <cstring>
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

}  // namespace orbitfuse::exporting
