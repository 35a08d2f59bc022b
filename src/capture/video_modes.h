// The capabilities of a V4L2 device.
#pragma once

#include <string>
#include <vector>

#include "capture/device.h"
#include "capture/video_calls.h"

namespace bslam::capture {

// A pixel format at a size. Devices that scale offer a range of sizes, which is listed by its ends.
struct VideoMode {
  FourCc pixels = 0;
  int width = 0, height = 0;          // pixels, the largest of a range; 0 if the driver does not report it
  int min_width = 0, min_height = 0;  // the smallest of a range; width and height if the size is fixed
  int step_width = 0, step_height = 0;
  std::vector<double> fps = {};  // frame rates in Hz, highest first; the two ends if they form a range; empty: unknown
  bool any_between = false;      // true: all rates between the highest and the lowest are possible

  bool has_size(int w, int h) const;
};

// Calls ioctl() and repeats it if a signal interrupted it.
int video_ioctl(VideoCalls& calls, int device, unsigned long request, void* argument);

// All modes of a capture device, in its order.
std::vector<VideoMode> video_modes(VideoCalls& calls, int device);

// One line: "GREY 752x480 (60, 30 frames/s), MJPG 1280x720 (5 to 30 frames/s)".
std::string modes_text(const std::vector<VideoMode>& modes);

// Returns the rate of a mode that suits a request best, in frames per second: the one that is asked for, or the highest
// up to 60; 0 if it has none or the driver does not report it.
double best_rate(const VideoMode& mode, const StreamRequest& request);

// Returns the mode for a request: of those of its size and of a known pixel format, one with its rate, or with the
// highest rate up to 60 frames/s, that needs least conversion; nullptr if there is none.
const VideoMode* choose_mode(const std::vector<VideoMode>& modes, const StreamRequest& request);

// Describes all video devices of the machine for the user: names, and what each offers.
std::string devices_text(VideoCalls& calls);
// For errors: "this computer has /dev/video0 (name), /dev/video2 (name)", or "... has none".
std::string devices_in_one_line(VideoCalls& calls);

}  // namespace bslam::capture
