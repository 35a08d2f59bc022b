#include "cli/view_arguments.h"

#include <charconv>
#include <utility>

namespace bslam::cli {
namespace {

constexpr std::uint16_t kUsualPort = 8642;
constexpr const char* kUsual = "usual";  // stands for the option without a value

}  // namespace

void add_view_options(CLI::App& verb, ViewArguments& arguments) {
  verb.add_flag(std::string("--view{") + kUsual + "}", arguments.port,
                "--view or --view=PORT: show the run in a browser while it goes on, at the address that is printed on "
                "stderr. PORT 0: any free one; without PORT: 8642, or any free one if that is in use");
  verb.add_option("--view-address", arguments.address,
                  "address of the network interface of the view; 0.0.0.0: all. The connection is not encrypted")
      ->capture_default_str();
}

Result<std::unique_ptr<live_view::LiveView>> start_view(const ViewArguments& arguments, live_view::Subject subject,
                                                        session::RunControl& control) {
  if (arguments.port.empty()) return std::unique_ptr<live_view::LiveView>();
  web_server::ServerOptions options{.address = arguments.address, .port = kUsualPort, .or_any_port = true};
  if (arguments.port != kUsual) {
    const std::string& text = arguments.port;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), options.port);
    if (error != std::errc() || end != text.data() + text.size())
      return Error{"command line", "--view", "'" + text + "'", "a port from 0 to 65535"};
    options.or_any_port = false;
  }
  auto view = live_view::LiveView::start(options, std::move(subject), control);
  if (view) return view;
  const Error& failed = view.error();
  return Error{"command line", failed.key == "address" ? "--view-address" : "--view", failed.found, failed.expected};
}

}  // namespace bslam::cli
