// SPDX-License-Identifier: BSD-3-Clause
// 01_register_clouds source.ply target.ply: brings two clouds of one object into one frame.
#include <iostream>
#include <orbitfuse/core/formats/ply.hpp>
#include <orbitfuse/recon/registration/register.hpp>

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: 01_register_clouds source.ply target.ply\n";
    return 2;
  }
  const auto source = orbitfuse::read_ply(argv[1]);
  const auto target = orbitfuse::read_ply(argv[2]);
  for (const auto* cloud : {&source, &target}) {
    if (!*cloud) {
      std::cerr << cloud->error().message() << "\n";
      return 1;
    }
  }
  const auto found = orbitfuse::register_clouds(*source, *target, {}, {});
  if (!found) {
    std::cerr << found.error().message() << "\n";
    return 1;
  }
  // x_in_target = scale * rotation * x_in_source + translation
  std::cout << found->target_from_source.matrix() << "\n" << found->brief() << "\n";
  if (found->ambiguous) std::cout << "another placement fits as well: " << found->ambiguity << "\n";
}
