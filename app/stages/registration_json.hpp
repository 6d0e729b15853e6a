// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <nlohmann/json.hpp>

#include "recon/registration/register.hpp"

namespace orbitfuse::stages {

/// All figures of a registration; the similarity as scale, quaternion, matrix and translation.
nlohmann::json to_json(const RegistrationReport& report);

/// [name, value] pairs for people, units in the names.
nlohmann::json facts(const RegistrationReport& report);

}  // namespace orbitfuse::stages
