// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include <filesystem>

#include "core/result.hpp"

namespace orbitfuse::pipeline {

/// What a stage finished is not written into: its next run would take that for damage, and delete
/// it. Of any run, also another one's. Error: usage.
Status check_outside_stages(const std::filesystem::path& target);

/// Whether the folder is there or could be made, and takes files; nothing is left there. What a
/// dry run would else learn from the real one, hours later. Errors: input (a file or a broken link
/// where a folder is needed), usage (a name too long, inside of a stage), device (permissions, a
/// full disk).
Status check_out_folder(const std::filesystem::path& folder);

/// The same for the folder of a file to write, which itself may be no folder.
Status check_out_file(const std::filesystem::path& file);

}  // namespace orbitfuse::pipeline
