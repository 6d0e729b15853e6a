// SPDX-License-Identifier: BSD-3-Clause
#include "capture/mat/mat_pdf.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cctype>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <optional>

#include "app/cli/typed_options.hpp"
#include "app/cli/verb.hpp"
#include "app/pipeline/out_folder.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::cli {
namespace {

struct MatArguments {
  std::string out, paper = "A4";
  double size_m = 0.6;
  std::optional<int> tags;
  bool thermal = false;
};

/// Nothing is overwritten or made on the way: a slip in the name would do harm or go unnoticed.
Status check_out(const std::string& out, bool force) {
  const std::filesystem::path file(out);
  std::string extension = file.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (extension != ".pdf" || file.stem().empty())
    return fail(ErrorKind::usage, "--out " + out, "is not the name of a PDF", "end it in .pdf");
  std::error_code error;
  const std::filesystem::path folder = file.has_parent_path() ? file.parent_path() : ".";
  if (!std::filesystem::is_directory(folder, error))
    return fail(ErrorKind::input, folder.string(), "no such folder",
                "make it first, or choose another");
  ORBITFUSE_TRY(pipeline::check_outside_stages(file));
  const auto status = std::filesystem::status(file, error);
  if (status.type() == std::filesystem::file_type::not_found) {
    if (::faccessat(AT_FDCWD, folder.c_str(), W_OK | X_OK, AT_EACCESS) == 0) return {};
    return fail(ErrorKind::device, folder.string(), std::strerror(errno),
                "check the permissions, or choose another folder");
  }
  if (error && status.type() == std::filesystem::file_type::none)
    return fail(ErrorKind::usage, "--out " + out, error.message(), "choose another name");
  if (!std::filesystem::is_regular_file(status))
    return fail(ErrorKind::input, out, "exists and is not a file", "choose another name");
  if (!force)
    return fail(ErrorKind::input, out, "exists already",
                "choose another name, or overwrite it: --force");
  return {};
}

Status run(Context& context, const MatArguments& o) {
  ORBITFUSE_TRY(check_out(o.out, context.common.force));
  MatDesign design = o.thermal ? MatDesign::for_thermal(o.size_m) : MatDesign{};
  design.size_m = o.size_m;
  if (o.tags) design.tags_per_side = *o.tags;
  ORBITFUSE_ASSIGN(const std::string pdf, mat_pdf(design, o.paper).map_error([](Error error) {
    return as_typed(
        std::move(error),
        {{"mat.size_m", "--size-m"}, {"mat.tags_per_side", "--tags"}, {"mat.paper", "--paper"}});
  }));
  if (context.common.dry_run) {
    context.console.info("would write " + o.out);
    return {};
  }
  ORBITFUSE_TRY(write_file_atomic(o.out, pdf));
  context.console.data(fmt::format("{}: {} x {} tags, each {:.0f} mm, on {:g} m", o.out,
                                   design.tags_per_side, design.tags_per_side,
                                   1000 * design.tag_m(), design.size_m));
  if (o.thermal)
    context.console.info("transfer it to aluminium foil and paint what is black with matt paint");
  context.console.info(fmt::format("capture with --mat {} --mat-tags {}",
                                   o.thermal ? "foil" : "paper", design.tags_per_side));
  context.result = {{"file", o.out},
                    {"size_m", design.size_m},
                    {"tags_per_side", design.tags_per_side},
                    {"tag_m", design.tag_m()}};
  return {};
}

}  // namespace

Action add_mat(CLI::App& app) {
  const auto options = std::make_shared<MatArguments>();
  app.add_option("--out", options->out,
                 "PDF to write; one that exists is overwritten only with --force")
      ->required();
  app.add_option("--size-m", options->size_m, "Side of the whole mat")->capture_default_str();
  app.add_option("--paper", options->paper,
                 "A4, A3, A1: tiles to glue together; one: a single page for a plotter")
      ->capture_default_str();
  app.add_option("--tags", options->tags, "Tags along a side; 9, or 5 with --thermal");
  app.add_flag("--thermal", options->thermal,
               "For foil and paint, which thermal cameras see: inverted, wider quiet zones");
  return [options](Context& context) { return run(context, *options); };
}

}  // namespace orbitfuse::cli
