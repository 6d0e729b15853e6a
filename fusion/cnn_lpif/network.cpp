// SPDX-License-Identifier: BSD-3-Clause
#include "fusion/cnn_lpif/network.hpp"

#include <algorithm>
#include <cstring>

namespace orbitfuse::embedded {
extern const std::string_view cnn_lpif_network;
}

namespace orbitfuse::fusion::cnn {

Result<Parameters> parameters_of_bytes(std::string_view bytes) {
  Parameters parameters;
  if (bytes.size() != sizeof parameters)
    return fail(
        ErrorKind::input, "network", std::to_string(bytes.size()) + " bytes",
        "must be " + std::to_string(sizeof parameters) + ": train it anew with train_network");
  std::memcpy(parameters.data(), bytes.data(), bytes.size());
  if (!std::all_of(parameters.begin(), parameters.end(), [](float v) { return std::isfinite(v); }))
    return fail(ErrorKind::input, "network", "weights that are not finite",
                "train it anew with train_network");
  return parameters;
}

std::string bytes_of(const Parameters& parameters) {
  return {reinterpret_cast<const char*>(parameters.data()), sizeof parameters};
}

const Parameters& shipped_network() {
  static const Parameters parameters = parameters_of_bytes(embedded::cnn_lpif_network).value();
  return parameters;
}

}  // namespace orbitfuse::fusion::cnn
