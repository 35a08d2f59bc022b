// bslam serve: localisation in a saved map as a service over HTTP.
#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <stop_token>
#include <string>
#include <utility>

#include "base/cores.h"
#include "cli/config_arguments.h"
#include "cli/interruption.h"
#include "cli/print_message.h"
#include "cli/verbs.h"
#include "image_decoding/image_file.h"
#include "map/rigs_of_map.h"
#include "map_service/answer.h"
#include "map_service/map_service.h"
#include "rig_formats/rig_file.h"
#include "storage/map_file.h"
#include "storage/vocabulary_file.h"

namespace bslam::cli {
namespace {

struct ServeArguments {
  std::string map, rig, vocabulary, token;
  std::string address = "127.0.0.1";
  ConfigArguments config;
  int port = 8090, workers = 0, queue = 16, max_request_mb = 32;
};

// A map, and the rig whose images are localised in it.
struct ServedMap {
  storage::SavedMap saved;
  camera::Rig rig;
};

// Without --rig the rig is that of the map.
Result<ServedMap> read_served_map(const ServeArguments& a, const system::Config& config,
                                  const place::Vocabulary& vocabulary) {
  auto own = storage::read_map(a.map);
  if (!own) return own.error();
  auto rig = a.rig.empty() ? Result<camera::Rig>(own->map.given_rig()) : rig_formats::read_rig(a.rig);
  if (!rig) return rig.error();
  const bool several = map::first_cameras_of_rigs(own->map).back() > 0;
  if (a.rig.empty() && several)
    return Error{a.map, "--rig", "nothing, for a map of several rigs",
                 "the calibration of the cameras of the requests"};
  if (own->info.vocabulary == 0)
    return Error{a.map, "vocabulary", "none", "a map with visual words, in which places can be recognised"};
  if (const Status s = storage::check_continued(*own, *rig, config.feature_model().pyramid, &vocabulary); !s)
    return s.error();
  return ServedMap{*std::move(own), *std::move(rig)};
}

map_service::MapSource source_of(const storage::SavedMap& saved) {
  map_service::MapSource source{.name = std::filesystem::path(saved.file).filename(),
                                .data = saved.info.data,
                                .made_by = saved.info.version,
                                .id = {},
                                .warning = saved.info.warning};
  for (const std::uint32_t checksum : saved.checksums) source.id += fmt::format("{:08x}", checksum);
  return source;
}

// Errors of the server, with the name of the option.
Error of_options(const Error& error) {
  return {"command line", error.key == "address" ? "--address" : "--port", error.found, error.expected};
}

void print_warnings_of(const ServeArguments& a, const map_service::MapSource& source) {
  if (!source.warning.empty())
    print_message("warning: {}: the run that made this map has found: {}\n", a.map, source.warning);
  const bool local = a.address.starts_with("127.") || a.address == "::1";
  if (!local && a.token.empty())
    print_message("warning: --address {} without --token: everybody who reaches this port can use the service\n",
                  a.address);
}

map_service::ServiceOptions service_options(const ServeArguments& a) {
  map_service::ServiceOptions options;
  options.server.address = a.address;
  options.server.port = static_cast<std::uint16_t>(a.port);
  options.workers = a.workers > 0 ? a.workers : processor_cores();
  options.queue = static_cast<std::size_t>(a.queue);
  options.max_request_bytes = static_cast<std::uint64_t>(a.max_request_mb) << 20;
  options.token = a.token;
  return options;
}

void wait_for(const std::stop_token& stop) {
  std::promise<void> stopped;
  const std::stop_callback callback(stop, [&stopped] { stopped.set_value(); });
  stopped.get_future().wait();
}

int serve(const ServeArguments& a) {
  const Interruption interruption;
  auto config = resolve_config(a.config);
  if (!config) return report_error(config.error());
  const auto vocabulary = storage::vocabulary_or_shipped(a.vocabulary);
  if (!vocabulary) return report_error(vocabulary.error());
  auto served = read_served_map(a, *config, **vocabulary);
  if (!served) return report_error(served.error());
  auto masks = image_decoding::read_masks(served->rig);
  if (!masks) return report_error(masks.error());

  const map_service::ServiceOptions options = service_options(a);
  if (config->execution.threads == 0) config->execution.threads = std::max(1, processor_cores() / options.workers);
  const map_service::MapSource source = source_of(served->saved);
  const auto localiser = std::make_shared<const system::Localiser>(served->rig, *config, std::move(served->saved.map),
                                                                   *vocabulary, *std::move(masks));
  auto service = map_service::MapService::start(options, localiser,
                                                map_service::map_json(source, localiser->map(), localiser->rig()));
  if (!service) return report_error(of_options(service.error()));
  print_warnings_of(a, source);
  fmt::print("serving {} at {} ({} worker{})\n", a.map, (*service)->url(), options.workers,
             options.workers == 1 ? "" : "s");
  std::fflush(stdout);
  wait_for(interruption.token());
  (*service)->finish();
  return kExitOk;
}

}  // namespace

void add_serve(CLI::App& app, int& exit_status) {
  const auto a = std::make_shared<ServeArguments>();
  CLI::App* verb = app.add_subcommand("serve", "localise images in a saved map over HTTP, until Ctrl-C");
  verb->add_option("map", a->map, "saved map, which is not changed")->required();
  verb->add_option("--rig", a->rig, "calibration of the cameras of the requests; default: that of the map");
  verb->add_option("--address", a->address,
                   "address of the network interface; 0.0.0.0: all. The connection is not encrypted")
      ->capture_default_str();
  verb->add_option("--port", a->port, "port; 0: any free one")->check(CLI::Range(0, 65535))->capture_default_str();
  verb->add_option("--workers", a->workers, "requests that are processed at once; default: one per core")
      ->check(CLI::Range(1, 256));
  verb->add_option("--queue", a->queue, "requests that may wait; further ones are answered with 503")
      ->check(CLI::Range(1, 10000))
      ->capture_default_str();
  verb->add_option("--max-request-mb", a->max_request_mb, "size of a request in MB (2^20 bytes); longer: 413")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  verb->add_option("--token", a->token, "answer only requests with the header Authorization: Bearer TOKEN")
      ->check([](const std::string& text) { return std::string(text.empty() ? "must not be empty" : ""); });
  verb->add_option("--vocabulary", a->vocabulary,
                   "vocabulary of the map, in bslam or DBoW2 text format; default: the one shipped with this program");
  add_config_options(*verb, a->config);
  verb->callback([a, &exit_status] { exit_status = serve(*a); });
}

}  // namespace bslam::cli
