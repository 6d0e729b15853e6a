// SPDX-License-Identifier: BSD-3-Clause
#include "drivers/aravis/link.hpp"

namespace orbitfuse::aravis {

std::vector<FoundCamera> discover() {
  arv_update_device_list();
  std::vector<FoundCamera> found;
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
    found.push_back({text(arv_get_device_id(i)), text(arv_get_device_model(i)),
                     text(arv_get_device_serial_nbr(i)), text(arv_get_device_address(i))});
  }
  return found;
}

}  // namespace orbitfuse::aravis
