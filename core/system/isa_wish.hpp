// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "core/result.hpp"

namespace orbitfuse {

/// Whether ORBITFUSE_ISA, where it is set, names an instruction set; usage error otherwise: a slip
/// would measure or test another one than was meant.
Status check_isa_wish();

}  // namespace orbitfuse
