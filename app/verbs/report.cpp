// SPDX-License-Identifier: BSD-3-Clause
#include <optional>

#include "app/cli/option_pairs.hpp"
#include "app/cli/run_stages.hpp"
#include "app/cli/verb.hpp"
#include "app/inspection/inspection.hpp"
#include "app/inspection/print_pdf.hpp"
#include "core/system/file_io.hpp"

namespace orbitfuse::cli {
namespace {
namespace fs = std::filesystem;

struct ReportArguments {
  StageFolders folders;
  std::optional<std::string> inspection;
  bool pdf = false, print_template = false;
};

Status write_inspection(Context& context, ReportArguments options) {
  if (options.pdf) ORBITFUSE_TRY(inspection::find_browser());
  ORBITFUSE_TRY(resolve(options.folders));
  const fs::path out = options.folders.out;
  ORBITFUSE_ASSIGN(const Session session, open_session(options.folders.session));
  ORBITFUSE_ASSIGN(const auto details, inspection::read_details(*options.inspection));
  ORBITFUSE_ASSIGN(
      const inspection::InspectionModel model,
      inspection::inspection_of(out, session, details, context.config, context.progress));
  const fs::path html = out / inspection::inspection_file,
                 pdf = out / inspection::inspection_pdf_file;
  context.result["findings"] = model.findings.size();
  if (model.findings.empty())
    context.console.warning(
        "no measurement is saved in " + out.string() +
        ": the report has no findings; save some with orbitfuse measure --save");
  if (context.common.dry_run) {
    context.console.info("would write " + html.string());
    return {};
  }
  // One of an earlier call would tell other findings.
  std::error_code ignored;
  fs::remove(pdf, ignored);
  ORBITFUSE_TRY(write_file_atomic(html, to_html(model)));
  context.console.info("inspection report: " + html.string());
  context.result["html"] = html.string();
  if (!options.pdf) return {};
  ORBITFUSE_TRY(inspection::print_pdf(html, pdf, context.progress));
  context.console.info("inspection report: " + pdf.string());
  context.result["pdf"] = pdf.string();
  return {};
}

Status report(Context& context, const ReportArguments& options) {
  ORBITFUSE_TRY(check_apart(
      {{"--inspection", options.inspection.has_value(), "--print-template", options.print_template},
       {"--pdf", options.pdf, "--print-template", options.print_template},
       {"session", !options.folders.session.empty(), "--print-template", options.print_template}}));
  if (options.print_template) {
    context.console.data(std::string(inspection::details_template()));
    context.result["template"] = inspection::details_template();
    return {};
  }
  if (options.inspection && options.inspection->empty())
    return fail(ErrorKind::usage, "--inspection", "an empty file name",
                "name the details; --print-template prints some to fill in");
  if (options.inspection) return write_inspection(context, options);
  if (options.pdf)
    return fail(ErrorKind::usage, "--pdf", "without --inspection",
                "name the details: --inspection FILE; --print-template prints one to fill in");
  return run_stages(context, options.folders, {"report"}, Missing::leave_out);
}

}  // namespace

Action add_report(CLI::App& app) {
  const auto options = std::make_shared<ReportArguments>();
  add_folders(app, options->folders);
  constexpr const char* group = "For a client (docs/inspection.md)";
  app.add_option("--inspection", options->inspection,
                 "Write inspection.html into the run's folder: its saved measurements as findings, "
                 "with the details of this TOML file")
      ->type_name("FILE")
      ->group(group);
  app.add_flag("--pdf", options->pdf, "And inspection.pdf, by headless Chromium")->group(group);
  app.add_flag("--print-template", options->print_template,
               "Print a file for --inspection, to be filled in")
      ->group(group);
  return [options, &app](Context& context) -> Status {
    if (options->print_template)
      ORBITFUSE_TRY(check_unused(app,
                                 {"--out", "--force", "--resume", "--seed", "--config", "--set"},
                                 "--print-template"));
    if (options->inspection)
      ORBITFUSE_TRY(check_unused(app, {"--force", "--resume", "--seed"}, "--inspection"));
    return report(context, *options);
  };
}

}  // namespace orbitfuse::cli
