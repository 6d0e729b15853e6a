#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>
#include "app/eval/ground_truth.hpp"
#include "app/eval/pose_error.hpp"
#include "app/stages/artifacts.hpp"
#include "core/image_io.hpp"
#include "recon/nerf/nerf.hpp"
#include "recon/poses/patch_matching.hpp"
#include "recon/poses/edge_field.hpp"
#include "recon/poses/render_alignment.hpp"
#include "recon/poses/proxy_images.hpp"
using namespace orbitfuse;
int main(int, char** argv) {
  const std::filesystem::path sess = argv[1], out = argv[2];
  const double noise = std::atof(argv[4]);
  const auto session = open_session(sess).value();
  const auto truth = eval::read_ground_truth(argv[3]).value();
  const auto model = stages::load_poses(out / "poses_visible", Modality::visible).value();
  const auto field = nerf::Field::load(out / "train_visible/field.bin").value();
  auto base = [](const FrameRecord& f){ return std::filesystem::path(f.source.empty() ? f.file : f.source).filename().string(); };
  std::vector<eval::PosePair> pairs;
  for (auto* f : session.frames_of(Modality::visible, false)) for (auto& v : model.views) if (v.name == f->file) for (auto& t : truth.views.at(Modality::visible)) if (std::filesystem::path(t.name).filename() == base(*f)) pairs.push_back({v.cam_from_world, t.cam_from_world});
  const Similarity3d truth_from_vis = eval::truth_from_estimate(pairs).value();
  SceneRenderer r = [&](const Camera& c, const Rigid3d& p) -> Result<SceneView> { auto s = nerf::render(field, c, p, {}, Progress{}).value(); SceneView v{{}, s.depth}; cv::cvtColor(s.color, v.brightness, cv::COLOR_RGB2GRAY); return v; };
  std::vector<PosedView> views; std::vector<Rigid3d> gt; std::vector<cv::Mat> images;
  std::mt19937 g(1); std::normal_distribution<double> n;
  for (auto* f : session.frames_of(Modality::thermal, false)) for (auto& t : truth.views.at(Modality::thermal)) if (std::filesystem::path(t.name).filename() == base(*f)) {
    if (views.size() >= 8) break;
    Rigid3d p = rebase(t.cam_from_world, truth_from_vis.inverse());
    gt.push_back(p);
    Eigen::Vector3d ax(n(g), n(g), n(g)); ax *= noise * M_PI / 180 / 1.7;
    // orbit about the centre: move the camera round the origin and re-aim
    Eigen::Quaterniond q(Eigen::AngleAxisd(ax.norm(), ax.normalized()));
    Rigid3d pert = p * Rigid3d{q, Eigen::Vector3d::Zero()};
    pert.translation *= 1 + 0.01 * noise * n(g);
    Eigen::Vector3d a2(n(g), n(g), n(g)); a2 *= noise * 0.3 * M_PI / 180;
    pert = Rigid3d{Eigen::Quaterniond(Eigen::AngleAxisd(a2.norm() + 1e-12, a2.normalized())), Eigen::Vector3d::Zero()} * pert;
    PosedView v{f->file, t.camera, pert}; v.camera = t.camera;
    views.push_back(v);
    images.push_back(read_luminance(session, *f).value());
  }
  auto report = [&](const RenderAlignment& a) { double e = 0, ro = 0; for (size_t i = 0; i < gt.size(); ++i) { double ce = (camera_center(a.views[i].view.cam_from_world) - camera_center(gt[i])).norm(); double rr = rotation_angle_deg(a.views[i].view.cam_from_world.rotation, gt[i].rotation); fmt::print("  {} centre {:.3f} rot {:.2f} matches {} med {:.2f} agr {:.3f}\n", i, ce, rr, a.views[i].matches, a.views[i].median_px, a.views[i].agreement); e += ce; ro += rr; } fmt::print(" mean centre {:.4f} rot {:.3f} focal {:.1f} (true {:.1f}) agr {:.3f}\n", e / gt.size(), ro / gt.size(), a.focal_px, views[0].camera.fx, a.mean_agreement()); };
  RenderAlignment s; for (auto& v : views) s.views.push_back({v, 0, 0, 0});
  fmt::print("start\n"); report(s);
  RenderAlignmentOptions o; auto rounds = coarse_rounds(); for (auto& q : fine_rounds()) rounds.push_back(q);
  for (auto& round : rounds) { o.rounds = {round}; auto a = align_with_renders(r, images, views, o, Progress{}).value(); fmt::print("round {}\n", round.width_px); report(a); for (size_t i = 0; i < views.size(); ++i) views[i] = a.views[i].view; 
  }
  for (int i = 0; i < 3; ++i) {
    Camera c = views[i].camera.scaled_to(320, 320 * views[i].camera.height / views[i].camera.width);
    auto sv = r(c, gt[i]).value(); cv::Mat e = rendered_edges(sv), small; cv::resize(images[i], small, {c.width, c.height}, 0, 0, cv::INTER_AREA); cv::Mat f = orientation_field(small, 1.0);
    fmt::print("truth agreement {:.3f}\n", edge_agreement(e, f));
    auto vis = [](const cv::Mat& m) { cv::Mat p[2], g2; cv::split(m, p); cv::magnitude(p[0], p[1], g2); g2.convertTo(g2, CV_8U, 255); return g2; };
    cv::Mat th; cv::normalize(small, th, 0, 255, cv::NORM_MINMAX, CV_8U); cv::Mat b; sv.brightness.convertTo(b, CV_8U, 255);
    cv::Mat dz; cv::Mat d = sv.depth.clone(); cv::patchNaNs(d, 0); cv::normalize(d, dz, 0, 255, cv::NORM_MINMAX, CV_8U);
    cv::Mat row1, row2, all; cv::hconcat(std::vector<cv::Mat>{th, b, dz}, row1); cv::hconcat(std::vector<cv::Mat>{vis(f), vis(e), dz}, row2); cv::vconcat(row1, row2, all); cv::imwrite(fmt::format("/tmp/app/dev{}.png", i), all);
  }
}
