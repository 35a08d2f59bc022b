// Shows a run in web browsers while it goes on, and lets them pause it and set its pace. The thread that feeds the
// frames only hands values over; everything else is done by the thread of the server, and only if a browser is
// connected.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "base/result.h"
#include "dataset/dataset.h"
#include "geometry/up_axis.h"
#include "session/run_control.h"
#include "session/run_observer.h"
#include "system/config.h"
#include "web_server/server.h"

namespace bslam::live_view {

// The run that is shown.
struct Subject {
  const dataset::Dataset& dataset;
  const system::Config& config;
  std::string command;                      // the command line
  std::size_t loaded_keyframes = 0;         // keyframe slots of the map that is continued; 0: none
  std::optional<geometry::UpAxis> up = {};  // what points upward in the view of the map; none: estimated
};

class LiveView final : public session::RunObserver {
 public:
  // `subject.dataset`, `subject.config` and `control` must outlive the view. Errors: see web_server::Server::start.
  static Result<std::unique_ptr<LiveView>> start(const web_server::ServerOptions& options, Subject subject,
                                                 session::RunControl& control);
  ~LiveView() override;

  const std::string& url() const;
  bool is_watched() const;  // by a browser

  void processed(session::ProcessedFrame&& frame, const system::System& system) override;
  void dropped(TimeNs time_ns, double read_ms) override;
  void fed() override;

  // Shows the data of the report at the end of the run. Waits until browsers have received them, for at most a second.
  void end(std::string report_json);

 private:
  class Content;
  explicit LiveView(std::unique_ptr<Content> content);
  std::unique_ptr<Content> content_;
  std::unique_ptr<web_server::Server> server_;  // declared last: it uses the content
};

}  // namespace bslam::live_view
