// bslam: visual SLAM for a rig of any number of cameras. This header includes the whole library; see docs/cpp.md.
//
//   auto rig = bslam::Rig::load("rig.yaml");
//   auto slam = bslam::System::create(*rig, bslam::Config());
//   for (const bslam::ImageBundle& images : camera_driver) {
//     auto frame = slam->process(images);
//     if (frame && frame->tracking()) publish_pose(frame->T_world_body);
//   }
//   slam->finish();
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
