#include <fstream>
#include <fmt/format.h>
#include <opencv2/imgproc.hpp>
#include "bench/poses/scenes.hpp"
#include "recon/poses/estimate_poses.hpp"
#include "recon/poses/edge_lines.hpp"
#include "core/image_io.hpp"
#include <chrono>
using namespace orbitfuse;
int main(int argc,char**){
  auto data=bench::shared_data(); bench::ContainerOptions co; co.thermal_focal_error=0.03; co.tracking=argc>1;
  auto scene=bench::container_scene(*data,co);
  VisibleScene vs; auto&r=vs.reconstruction; for(auto&f:scene.session.frames) if(f.modality==Modality::visible) r.views.push_back(scene.truth.views.at(f.file));
  PoseOptions o; o.colmap="/bin/none";
  auto t=estimate_thermal_poses(scene.session,&vs,o,"/tmp/poses/devrun",{});
  if(!t){fmt::print("{}\n",t.error().message());return 1;}
  for(auto&s:t->ladder) fmt::print("{} {} {} {:.1f}s\n",s.rung,s.held,s.why,s.seconds);
  for(auto&d:t->dropped) fmt::print("dropped {} {}\n",d.name,d.why);
  for(auto&[k,v]:t->gates) fmt::print("{}={:.4f}\n",k,v);
  auto e=bench::pose_error(t->reconstruction,r,scene.truth);
  fmt::print("{} views ATE {:.3f} med {:.3f} worst {:.3f} rot {:.3f} worst {:.3f}\n",e.views,e.ate_percent,e.median_percent,e.worst_percent,e.rotation_deg,e.worst_rotation_deg);
  for(auto&v:t->reconstruction.views){auto&g=scene.truth.views.at(v.name); fmt::print("{} dC {:.3f} m (range {:+.3f}) rot {:.2f}\n",v.name,(camera_center(v.cam_from_world)-camera_center(g.cam_from_world)).norm(), camera_center(v.cam_from_world).norm()-camera_center(g.cam_from_world).norm(),rotation_angle_deg(v.cam_from_world.rotation,g.cam_from_world.rotation));}
}
