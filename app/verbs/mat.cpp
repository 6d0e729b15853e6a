// SPDX-License-Identifier: BSD-3-Clause
#include "capture/mat/mat_pdf.hpp"

#include <fmt/format.h>

#include "app/cli/verb.hpp"
#include "core/file_io.hpp"

namespace orbitfuse::cli {
namespace {

struct Options {
  std::string out, paper = "A4";
  double size_m = 0.6;
  int tags = 0;
  bool thermal = false;
};

Status run(Context& context, const Options& o) {
  MatDesign design = o.thermal ? MatDesign::for_thermal(o.size_m) : MatDesign{};
  design.size_m = o.size_m;
  if (o.tags > 0) design.tags_per_side = o.tags;
  ORBITFUSE_ASSIGN(const std::string pdf, mat_pdf(design, o.paper));
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
  const auto options = std::make_shared<Options>();
  app.add_option("--out", options->out, "PDF to write")->required();
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
