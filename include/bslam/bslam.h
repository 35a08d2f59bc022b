// bslam: visual SLAM for a rig of any number of cameras. This header includes the whole library.
//
//   auto rig = bslam::Rig::load("rig.yaml");
//   if (!rig) return report(rig.error().message());
//   auto slam = bslam::System::create(*rig, bslam::Config());
//   if (!slam) return report(slam.error().message());
//   for (const bslam::ImageBundle& images : camera_driver) {
//     auto frame = slam->process(images);
//     if (frame && frame->tracking()) publish_pose(frame->T_world_body);
//   }
//   if (bslam::Status done = slam->finish(); !done) return report(done.error().message());
//
// The headers require only C++17 and the standard library.
#pragma once

#include "bslam/config.h"
#include "bslam/frame_result.h"
#include "bslam/image_bundle.h"
#include "bslam/map_view.h"
#include "bslam/pose.h"
#include "bslam/result.h"
#include "bslam/rig.h"
#include "bslam/synchronizer.h"
#include "bslam/system.h"
#include "bslam/trajectory.h"
