// SPDX-License-Identifier: BSD-3-Clause
#pragma once

#include "fusion/metrics/planes.hpp"

// The measures on single planes of one size. A value that the published formula leaves undefined
// (0/0 on constant images) is defined here, beside each.
namespace orbitfuse::metrics {

// statistics.cpp
double mean(const Plane& f);
double standard_deviation(const Plane& f);  ///< sqrt(sum (F-mean)^2 / N)
double spatial_frequency(const Plane& f);   ///< Eskicioglu and Fisher 1995, N = all pixels
double average_gradient(const Plane& f);    ///< Cui et al. 2015; / ((m-1)(n-1))
double edge_intensity(const Plane& f);      ///< mean 3x3 Sobel magnitude, border repeated
double mean_squared_error(const Plane& a, const Plane& b);
double correlation(const Plane& a, const Plane& b);  ///< Pearson; 0 when one is constant
double psnr_db(double mean_squared);                 ///< peak 255, at most identical_psnr_db

// information.cpp
double entropy_bits(const Plane& f);  ///< 256 bins of the rounded samples, log2
double mutual_information_nats(const Plane& a, const Plane& b);  ///< 256 bins each, of 0..255
double cross_entropy_bits(const Plane& source,
                          const Plane& f);  ///< bins that are empty in one: skipped
double histogram_intersection(const Plane& a, const Plane& b);  ///< sum min(p, q), 256 bins

// Against both sources: the classes compute once what depends on these alone, however many fused
// images are compared with them.

// structure.cpp
double structural_similarity(const Plane& a,
                             const Plane& b);  ///< Wang 2004: 11x11, sigma 1.5, valid

/// Means and mean squares of a plane within SSIM's windows.
struct WindowMoments {
  explicit WindowMoments(const Plane& plane);
  Plane mean, square;
};
struct SourceSimilarity {
  double visible = 0, thermal = 0;
};
class StructuralSimilarity {
 public:
  StructuralSimilarity(const Plane& visible, const Plane& thermal);
  SourceSimilarity of(const Plane& fused) const;

 private:
  Plane visible_, thermal_;
  WindowMoments of_visible_, of_thermal_;
};

/// Sobel responses with zeros outside.
struct Edges {
  explicit Edges(const Plane& plane);
  Plane strength, angle;
};
/// Xydeas and Petrovic 2000. Without any edge in the sources: 1 if the fused image has none, else
/// 0.
class EdgeTransfer {
 public:
  EdgeTransfer(const Plane& visible, const Plane& thermal) : visible_(visible), thermal_(thermal) {}
  double of(const Plane& fused) const;

 private:
  Edges visible_, thermal_;
};

// perception.cpp
/// Chen and Blum 2009 (no contrast in source and fused counts as kept) and Chen and Varshney 2007
/// (lower is better; without edges all blocks weigh alike), of planes that went through
/// `stretched`.
class Perception {
 public:
  struct Quality {
    double qcb = 0, qcv = 0;
  };
  Perception(const Plane& visible, const Plane& thermal);
  Quality of(const Plane& fused) const;

 private:
  /// A plane as the two models of the eye see it.
  struct Seen {
    Plane contrast;     ///< Chen and Blum's masked contrast
    Plane sensitivity;  ///< through Mannos and Sakrison's filter
  };
  Seen seen(const Plane& plane) const;
  double chen_blum(const Plane& fused) const;
  double chen_varshney(const Plane& fused) const;

  Plane contrast_filter_, sensitivity_filter_;
  Seen visible_, thermal_;
  Plane visible_energy_, thermal_energy_;  ///< of the edges of 16 x 16 blocks
};

// halo.cpp
/// How far the fused level lies from both sources' within a patch's reach of an edge, gray levels
/// beyond 8; levels are medians of 15x15 patches. 0: every level beside an edge is one of the
/// sources'. A glow round a hot part, or a sky half taken from each source, is far from both. 0
/// without edges.
class Halo {
 public:
  Halo(const Plane& visible, const Plane& thermal);
  double of(const Plane& fused) const;

 private:
  cv::Mat1b visible_, thermal_, near_edge_;
};

}  // namespace orbitfuse::metrics
