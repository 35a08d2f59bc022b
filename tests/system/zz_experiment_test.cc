#include <gtest/gtest.h>
#include "system/closed_walk.h"
#include "system/stopwatch.h"
#include <cstdlib>
namespace bslam::system {
void go(const char* name, const Playback& p, Config c, Resources res, bool verbose=true) {
  Stopwatch w;
  printf("=== %s\n", name);
  System system(closed_walk().rig(), c, std::move(res));
  geometry::SE3 lo, lm; std::size_t i=0;
  for (const auto& f : p.frames) {
    const std::size_t before = system.loops().size();
    const auto& r = system.process(f);
    int inl=0; for (auto& cc : r.result.cameras) inl += cc.inliers;
    const auto m = system.snapshot();
    double eo=0, em=0;
    if (i) {
      auto rel = p.truth[i].T_world_frame.inverse()*p.truth[i-1].T_world_frame;
      auto est = r.T_rig_odom*lo.inverse();
      eo = (rel.inverse()*est).translation().norm();
      em = (r.T_map_odom*lm.inverse()).translation().norm();
    }
    lo=r.T_rig_odom; lm=r.T_map_odom; ++i;
    if (verbose) {
    printf("%d st %d %s kf %d inl %d kfs %zu lms %zu root %d parts %zu odomerr %.4f mapjump %.4f  %.1fms", f.id.value(), (int)r.result.status, std::string(tracking::describe(r.result.reason)).c_str(), r.keyframe, inl, m->num_keyframes(), m->num_landmarks(), r.root.value(), system.trajectories().size(), eo, em, r.frame_ms);
    if (r.relocalisation) printf(" RELOC with %d inl %d", r.relocalisation->with.value(), r.relocalisation->inliers);
    printf("\n"); }
    if (system.loops().size() > before) { const auto l = system.loops().back(); printf("LOOP %d with %d inliers %d moved %.4f turned %.4f off %.2f joined %d\n", l.closure.keyframe.value(), l.closure.with.value(), l.closure.inliers, l.closure.moved, l.closure.turned, l.closure.off_px, l.closure.joined);} 
  }
  system.finish();
  auto inv = system.snapshot()->check_invariants();
  printf("run %.0f ms; tracked %zu parts %zu started %d ate %f live %f loops %zu %s\n", w.ms(), tracked_frames(system), system.trajectories().size(), system.maps_started(), ate_m(final_poses(system), p.truth), ate_m(live_poses(system), p.truth), system.loops().size(), inv ? inv->c_str() : "ok");
}
TEST(Experiment, Walk) {
  Stopwatch w0;
  const RenderedTour& walk = closed_walk();
  printf("render %.0f ms\n", w0.ms());
  Config c = small_config(Mode::kSequential);
  go("plain", play(walk, {{0,kWalk}}), c, with_vocabulary());
  Config c2=c; c2.looping.loop.near_px=0;
  go("near_px 0", play(walk, {{0,kWalk}}), c2, with_vocabulary());
  c2.final_adjustment=false;
  go("near_px 0 no final", play(walk, {{0,kWalk}}), c2, with_vocabulary(), false);
  go("no voc no final", play(walk, {{0,kWalk}}), c2, {}, false);
  Playback k = play(walk, {{0,30},{30,33},{8,20}});
  for (int i=30;i<33;++i) for (auto& im : k.frames[i].images) blacken(im);
  go("kidnapped", k, c, with_vocabulary());
  Config c3=c; c3.looping.recovery.new_part_after=3;
  go("new part", play(walk, {{0,16},{36,kWalk}}), c3, with_vocabulary());
}
}
