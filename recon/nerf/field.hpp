// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <memory>

#include "core/modality.hpp"
#include "core/result.hpp"

namespace orbitfuse::nerf {

struct FieldState;  // parameters, occupancy and optimiser state (private)

/// A trained radiance field: density everywhere, colour or temperature per direction.
class Field {
 public:
  Field();
  ~Field();
  Field(Field&&) noexcept;
  Field& operator=(Field&&) noexcept;

  /// Reads what save() or a training checkpoint wrote. Input error: no file, cut or altered, of
  /// another version of this program.
  static Result<Field> load(const std::filesystem::path& path);
  /// Atomically, with the optimiser's state. Errors: input (the field is empty), device.
  Status save(const std::filesystem::path& path) const;

  bool empty() const { return !state_; }
  Modality modality() const;
  /// Centre and half extent (world units) of the region the cameras look at; beyond it space is
  /// contracted.
  Eigen::Vector3d center() const;
  double radius() const;
  /// Training steps behind this field.
  int iterations() const;

  FieldState& state() { return *state_; }
  const FieldState& state() const { return *state_; }
  explicit Field(std::unique_ptr<FieldState> state);

 private:
  std::unique_ptr<FieldState> state_;
};

}  // namespace orbitfuse::nerf
