// SPDX-License-Identifier: BSD-3-Clause
#include <fmt/format.h>

#include <opencv2/imgproc.hpp>

#include "bench/fusion/modes.hpp"
#include "fusion/metrics/metrics.hpp"

namespace orbitfuse::bench {
namespace {

/// One pair fused without and with skipping.
struct Comparison {
  double before = 0, after = 0;  ///< Qabf
  SkippedShares skipped;
};

/// 255 in an ellipse of a third of the image's width and height: a thermal field that covers part.
cv::Mat1b partial_mask(cv::Size size) {
  cv::Mat1b mask = cv::Mat1b::zeros(size);
  cv::ellipse(mask, {size.width / 2, size.height / 2}, {size.width / 6, size.height / 6}, 0, 0, 360,
              255, cv::FILLED);
  return mask;
}

double qabf(const Pair& pair, const cv::Mat& mask, const FusionOptions& options,
            FusionReport& report) {
  const cv::Mat fused = fuse(pair.visible, pair.thermal, mask, options, &report).value();
  const auto values = fusion_metrics(pair.visible, pair.thermal, fused).value();
  for (const MetricValue& v : values)
    if (v.name == "Qabf") return v.value;
  return 0;
}

Comparison compare(const Pair& pair, const cv::Mat& mask, FusionOptions options) {
  Comparison result;
  FusionReport report;
  options.skip_unneeded = false;
  result.before = qabf(pair, mask, options, report);
  options.skip_unneeded = true;
  result.after = qabf(pair, mask, options, report);
  result.skipped = report.skipped;
  return result;
}

void print(const std::string& what, const Comparison& c) {
  fmt::print("| {} | {:.1f} % | {:.1f} % | {:.1f} % | {:.4f} | {:.4f} |\n", what,
             100 * c.skipped.patches, 100 * c.skipped.pixels, 100 * c.skipped.levels, c.before,
             c.before - c.after);
}

/// A line for each pair on which anything was skipped, and the mean over all.
void compare_all(const std::vector<Pair>& pairs, const FusionOptions& options, bool partial) {
  Comparison mean;
  const auto n = static_cast<double>(pairs.size());
  for (const Pair& pair : pairs) {
    const Comparison c =
        compare(pair, partial ? cv::Mat(partial_mask(pair.visible.size())) : cv::Mat(), options);
    if (!partial && c.skipped.patches + c.skipped.pixels + c.skipped.levels > 0)
      print(pair.name, c);
    mean.before += c.before / n;
    mean.after += c.after / n;
    mean.skipped.patches += c.skipped.patches / n;
    mean.skipped.pixels += c.skipped.pixels / n;
    mean.skipped.levels += c.skipped.levels / n;
  }
  print(partial ? "mean, thermal image covers a third" : "mean", mean);
}

}  // namespace

int skipping(const std::filesystem::path& folder) {
  const auto pairs = load_pairs(folder);
  const Pair timed = timed_pair(pairs);
  for (const std::string& method : scored_methods()) {
    FusionOptions options;
    options.method = fusion_method(method).value();
    const auto cpu_ms = [&](bool skip, const cv::Mat& mask) {
      options.skip_unneeded = skip;
      return times_of(15, [&] { fuse(timed.visible, timed.thermal, mask, options).value(); })
          .cpu_ms;
    };
    const cv::Mat part = partial_mask(timed.visible.size());
    fmt::print(
        "\n`{}`: {:.1f} CPU ms without skipping, {:.1f} with; {:.1f} and {:.1f} where the thermal "
        "image covers a "
        "third of width and height.\n\n| pair | patches | pixels | levels | Qabf | lost "
        "|\n|---|---|---|---|---|---|\n",
        method, cpu_ms(false, {}), cpu_ms(true, {}), cpu_ms(false, part), cpu_ms(true, part));
    compare_all(pairs, options, false);
    compare_all(pairs, options, true);
  }
  return 0;
}

}  // namespace orbitfuse::bench
