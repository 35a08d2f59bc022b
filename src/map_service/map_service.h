// Localisation in a map as a service over HTTP: images of a rig in, a pose with its covariance out. Every request is
// independent of all others. The interface is documented in docs/serve.md.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "base/result.h"
#include "system/localiser.h"
#include "web_server/http_server.h"

namespace bslam::map_service {

struct ServiceOptions {
  web_server::ServerOptions server;
  int workers = 1;         // threads that localise
  std::size_t queue = 16;  // requests that may wait for a worker; further ones are answered with 503
  std::uint64_t max_request_bytes = 32u << 20;  // maximum size of one body
  std::string token = {};                       // token that requests must have; empty: none
};

class MapService {
 public:
  // Begins to answer requests. `map_json`: the answer to GET /v1/map. Errors: see web_server::HttpServer::start.
  static Result<std::unique_ptr<MapService>> start(const ServiceOptions& options,
                                                   std::shared_ptr<const system::Localiser> localiser,
                                                   std::string map_json);
  // Closes all connections, after the frames that are being processed.
  ~MapService();
  MapService(const MapService&) = delete;
  MapService& operator=(const MapService&) = delete;

  const std::string& url() const;  // such as http://127.0.0.1:8090

  // Accepts no further requests, and answers those that were accepted.
  void finish();

 private:
  class Implementation;
  explicit MapService(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace bslam::map_service
