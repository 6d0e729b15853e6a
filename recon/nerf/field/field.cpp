// SPDX-License-Identifier: BSD-3-Clause
#include "recon/nerf/field.hpp"

#include "recon/nerf/field/field_state.hpp"

namespace orbitfuse::nerf {

Field::Field() = default;
Field::~Field() = default;
Field::Field(Field&&) noexcept = default;
Field& Field::operator=(Field&&) noexcept = default;
Field::Field(std::unique_ptr<FieldState> state) : state_(std::move(state)) {}

Modality Field::modality() const { return state_ ? state_->modality : Modality::visible; }
Eigen::Vector3d Field::center() const {
  return state_ ? state_->space.center : Eigen::Vector3d::Zero();
}
double Field::radius() const { return state_ ? state_->space.radius : 0; }
int Field::iterations() const { return state_ ? state_->step : 0; }

}  // namespace orbitfuse::nerf
