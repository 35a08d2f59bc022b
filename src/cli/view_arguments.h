// Options of the live view of a run.
#pragma once

#include <CLI/CLI.hpp>
#include <memory>
#include <string>

#include "base/result.h"
#include "live_view/live_view.h"

namespace bslam::cli {

struct ViewArguments {
  std::string port;  // empty: no view; kUsual (view_arguments.cc) if the option has no value
  std::string address = "127.0.0.1";
};

void add_view_options(CLI::App& verb, ViewArguments& arguments);

// Begins to serve the view. Returns null if it is not requested. Errors: the port is not a number or in use, or the
// address is not that of an interface. See LiveView::start for what must outlive the view.
Result<std::unique_ptr<live_view::LiveView>> start_view(const ViewArguments& arguments, live_view::Subject subject,
                                                        session::RunControl& control);

}  // namespace bslam::cli
