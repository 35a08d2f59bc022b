// bslam data: describes recordings.
#include <cstdio>
#include <memory>

#include "cli/dataset_arguments.h"
#include "cli/verbs.h"
#include "session/data_report.h"
#include "system/config.h"

namespace bslam::cli {
namespace {

struct InfoArguments {
  DatasetArguments data;
  bool json = false;
};

int data_info(const InfoArguments& arguments) {
  const auto request = dataset_request(arguments.data, system::Config().io.sync_tolerance);
  if (!request) return report_error(request.error());
  const auto report = session::report_data(*request, arguments.json);
  if (!report) return report_error(report.error());
  std::fputs(report->text.c_str(), stdout);
  return report->runs ? kExitOk : kExitBadInput;
}

}  // namespace

void add_data(CLI::App& app, int& exit_status) {
  CLI::App* data = app.add_subcommand("data", "describe recordings");
  data->require_subcommand(1);
  const auto arguments = std::make_shared<InfoArguments>();
  CLI::App* info = data->add_subcommand(
      "info", "print the content of a recording, which stream is which camera, and what is missing for bslam run");
  add_dataset_options(*info, arguments->data);
  info->add_flag("--json", arguments->json, "print JSON");
  info->callback([arguments, &exit_status] { exit_status = data_info(*arguments); });
}

}  // namespace bslam::cli
