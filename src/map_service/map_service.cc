#include "map_service/map_service.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <exception>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "base/stopwatch.h"
#include "map_service/answer.h"
#include "map_service/bounded_queue.h"
#include "map_service/localise_request.h"
#include "map_service/metrics.h"

namespace bslam::map_service {
namespace {

using web_server::RequestHead;
using web_server::Respond;
using web_server::Response;

constexpr std::size_t kConnections = 256;
constexpr auto kRequestTime = std::chrono::seconds(30);
constexpr auto kFinishTime = std::chrono::seconds(60);

constexpr std::string_view kLocalise = "/v1/localise", kMap = "/v1/map", kMetrics = "/metrics", kHealth = "/healthz";
constexpr std::array<std::string_view, 4> kPaths = {kLocalise, kMap, kMetrics, kHealth};

Response json_response(int status, std::string body) { return {status, std::move(body), "application/json"}; }
Response error_response(int status, std::string_view message) { return json_response(status, error_json(message)); }

Response busy_response() {
  Response response = error_response(503, "too many requests: try again later");
  response.headers = {{"Retry-After", "1"}};
  return response;
}

// The bodies that may be in memory at once: those of the requests that are processed or wait, and one that arrives.
web_server::HttpLimits limits_of(const ServiceOptions& options) {
  const std::uint64_t requests = options.queue + static_cast<std::uint64_t>(options.workers) + 1;
  return {.connections = kConnections,
          .body_bytes = options.max_request_bytes,
          .all_bodies_bytes = requests * options.max_request_bytes,
          .request_time = kRequestTime};
}

}  // namespace

// A request that waits for a worker.
struct Job {
  std::string content_type, body;
  Respond respond;
  Stopwatch since_request = {};
};

class MapService::Implementation final : public web_server::RequestHandler {
 public:
  Implementation(const ServiceOptions& options, std::shared_ptr<const system::Localiser> localiser,
                 std::string map_json)
      : options_(options),
        loopback_(web_server::is_loopback(options.server.address)),
        localiser_(std::move(localiser)),
        map_json_(std::move(map_json)),
        queue_(options.queue) {}

  ~Implementation() override {
    queue_.close();
    workers_.clear();  // joins; what they answer with needs the server
    server_.reset();   // its thread uses the queue
  }

  Status start() {
    auto server = web_server::HttpServer::start(options_.server, limits_of(options_), *this);
    if (!server) return server.error();
    server_ = *std::move(server);
    for (int i = 0; i < options_.workers; ++i) workers_.emplace_back([this] { work(); });
    return {};
  }

  const std::string& url() const { return server_->url(); }

  void finish() {
    queue_.close();
    server_->finish(kFinishTime);
  }

  // ---- Called by the thread of the server

  std::optional<Response> refuse(const RequestHead& head) override {
    const std::string_view path = web_server::path_of(head.target);
    if (path != kHealth) {
      if (auto refused = check_permission(head)) return refused;
    }
    if (std::ranges::find(kPaths, path) == kPaths.end())
      return error_response(404, "there is nothing here; see /v1/localise, /v1/map, /metrics and /healthz");
    const std::string_view method = path == kLocalise ? "POST" : "GET";
    if (head.method != method) {
      Response response = error_response(405, "this path answers " + std::string(method) + " only");
      response.headers = {{"Allow", std::string(method)}};
      return response;
    }
    if (path == kLocalise && queue_.is_full()) return busy_response();
    return std::nullopt;
  }

  Response refusal(int status, std::string_view sentence) override { return error_response(status, sentence); }

  void handle(const RequestHead& head, std::string body, Respond respond) override {
    const std::string_view path = web_server::path_of(head.target);
    if (path == kHealth) return respond({200, "ok\n"});
    if (path == kMap) return respond(json_response(200, map_json_));
    if (path == kMetrics) return respond({200, metrics_.text(gauges()), "text/plain; version=0.0.4; charset=utf-8"});
    Job job{std::string(head.content_type), std::move(body), std::move(respond)};
    if (!queue_.push(std::move(job))) job.respond(busy_response());
  }

  void answered(const RequestHead& head, int status) override {
    const auto path = std::ranges::find(kPaths, web_server::path_of(head.target));
    metrics_.count_request(path == kPaths.end() ? "other" : *path, status);
  }

 private:
  std::optional<Response> check_permission(const RequestHead& head) const {
    if (options_.token.empty()) {  // pages of other sites can send requests to this machine
      if (web_server::is_own_request(head, loopback_)) return std::nullopt;
      return error_response(403, "the Host or the Origin of the request is not this server");
    }
    if (web_server::has_bearer_token(head, options_.token)) return std::nullopt;
    Response response = error_response(401, "the header Authorization must be Bearer and the token of this server");
    response.headers = {{"WWW-Authenticate", "Bearer"}};
    return response;
  }

  Gauges gauges() const {
    return {queue_.size(), options_.queue, static_cast<std::size_t>(options_.workers),
            localiser_->map().num_keyframes(), localiser_->map().num_landmarks()};
  }

  // ---- Called by the workers

  void work() {
    while (std::optional<Job> job = queue_.pop()) {
      Response response;
      try {
        response = localise(*job);
      } catch (const std::exception&) {  // such as a lack of memory
        response = error_response(500, "the server has failed to process this request");
      }
      try {
        job->respond(std::move(response));
      } catch (const std::exception&) {  // the connection ends without an answer
      }
    }
  }

  Response localise(Job& job) {
    const double waited_ms = job.since_request.ms();
    const auto images = images_of_request(job.content_type, job.body, localiser_->rig());
    if (!images) return error_response(400, images.error().message());
    job.body = {};
    const auto record = localiser_->localise(*images);
    if (!record) return error_response(400, record.error().message());
    Response response = json_response(200, localisation_json(*record, localiser_->rig()));
    const double all_ms = job.since_request.ms();
    metrics_.count_frame(record->result.status == tracking::TrackStatus::kTracking, 1e-3 * all_ms);
    response.headers = {{"Server-Timing", "queue;dur=" + std::to_string(waited_ms) +
                                              ", localise;dur=" + std::to_string(all_ms - waited_ms)}};
    return response;
  }

  const ServiceOptions options_;
  const bool loopback_;
  const std::shared_ptr<const system::Localiser> localiser_;
  const std::string map_json_;
  Metrics metrics_;
  std::unique_ptr<web_server::HttpServer> server_;
  BoundedQueue<Job> queue_;
  std::vector<std::jthread> workers_;
};

MapService::MapService(std::unique_ptr<Implementation> implementation) : implementation_(std::move(implementation)) {}
MapService::~MapService() = default;

Result<std::unique_ptr<MapService>> MapService::start(const ServiceOptions& options,
                                                      std::shared_ptr<const system::Localiser> localiser,
                                                      std::string map_json) {
  auto implementation = std::make_unique<Implementation>(options, std::move(localiser), std::move(map_json));
  if (const Status s = implementation->start(); !s) return s.error();
  return std::unique_ptr<MapService>(new MapService(std::move(implementation)));
}

const std::string& MapService::url() const { return implementation_->url(); }
void MapService::finish() { implementation_->finish(); }

}  // namespace bslam::map_service
