// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <optional>
#include <string_view>

namespace orbitfuse {

enum class Modality { visible, thermal };

constexpr std::string_view name(Modality modality) {
  return modality == Modality::visible ? "visible" : "thermal";
}

constexpr std::optional<Modality> modality_from_name(std::string_view text) {
  if (text == "visible") return Modality::visible;
  if (text == "thermal") return Modality::thermal;
  return std::nullopt;
}

}  // namespace orbitfuse
