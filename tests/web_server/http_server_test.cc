#include "web_server/http_server.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <ctime>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>
#include <vector>

namespace bslam::web_server {
namespace {

// A connection to a server of this machine.
class Client {
 public:
  explicit Client(const std::string& url) : Client(url, ::socket(AF_INET, SOCK_STREAM, 0)) {}
  Client(const std::string& url, int socket) : socket_(socket) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(std::stoi(url.substr(url.rfind(':') + 1))));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
  }
  ~Client() { ::close(socket_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  void send(const std::string& text) { ::send(socket_, text.data(), text.size(), MSG_NOSIGNAL); }
  void post(const std::string& body, std::size_t length) {
    send("POST /a HTTP/1.1\r\nHost: x\r\nContent-Length: " + std::to_string(length) + "\r\n\r\n" + body);
  }
  // All that the server sends until it ends the connection.
  std::string answer() {
    std::string text;
    char buffer[1000];
    for (ssize_t n = 0; (n = ::recv(socket_, buffer, sizeof(buffer), 0)) > 0;)
      text.append(buffer, static_cast<std::size_t>(n));
    return text;
  }

 private:
  const int socket_;
};

// Keeps accepted requests until the test answers them.
class Recorder final : public RequestHandler {
 public:
  std::optional<Response> refuse(const RequestHead& head) override {
    if (head.target == "/refused") return Response{403, "no"};
    return std::nullopt;
  }
  void handle(const RequestHead& head, std::string body, Respond respond) override {
    const std::lock_guard lock(mutex_);
    accepted_ = {std::string(head.target) + " " + std::move(body), std::move(respond)};
    changed_.notify_all();
  }
  void answered(const RequestHead&, int status) override {
    const std::lock_guard lock(mutex_);
    late_ += status == 408 ? 1 : 0;
    changed_.notify_all();
  }

  using Accepted = std::pair<std::string, Respond>;
  Accepted accepted() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return accepted_.second != nullptr; });
    return std::exchange(accepted_, {});
  }
  void wait_until_one_was_late() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return late_ == 1; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  Accepted accepted_;
  int late_ = 0;
};

std::unique_ptr<HttpServer> start(RequestHandler& handler) {
  const HttpLimits limits{.body_bytes = 100, .all_bodies_bytes = 150, .request_time = std::chrono::seconds(1)};
  return *HttpServer::start({}, limits, handler);
}

bool begins(const std::string& answer, const std::string& status) { return answer.starts_with("HTTP/1.1 " + status); }

TEST(HttpServer, AnotherThreadAnswersAWholeRequest) {
  Recorder recorder;
  const auto server = start(recorder);
  Client client(server->url());
  client.post("some ", 9);
  client.send("body");
  auto [request, respond] = recorder.accepted();
  EXPECT_EQ(request, "/a some body");
  std::jthread([&respond = respond] { respond({200, "text", "text/plain", {{"X-Y", "z"}}}); }).join();
  respond = {};
  const std::string answer = client.answer();
  EXPECT_TRUE(begins(answer, "200")) << answer;
  EXPECT_NE(answer.find("\r\nX-Y: z\r\n"), std::string::npos) << answer;
  EXPECT_TRUE(answer.ends_with("\r\n\r\ntext")) << answer;
}

// Takes all file descriptors that this process may open.
class NoFileDescriptors {
 public:
  NoFileDescriptors() {
    EXPECT_EQ(::getrlimit(RLIMIT_NOFILE, &before_), 0);
    const int lowest = ::dup(0);  // the lowest free number
    files_.push_back(lowest);
    const rlimit few{static_cast<rlim_t>(lowest) + 50, before_.rlim_max};
    EXPECT_EQ(::setrlimit(RLIMIT_NOFILE, &few), 0);
    for (int file = 0; (file = ::dup(0)) >= 0;) files_.push_back(file);
  }
  ~NoFileDescriptors() {
    ::setrlimit(RLIMIT_NOFILE, &before_);
    for (const int file : files_) ::close(file);
  }
  NoFileDescriptors(const NoFileDescriptors&) = delete;
  NoFileDescriptors& operator=(const NoFileDescriptors&) = delete;

 private:
  rlimit before_{};
  std::vector<int> files_;
};

double process_ms() {
  timespec now{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

TEST(HttpServer, WaitsWhereNoFileDescriptorIsLeft) {
  Recorder recorder;
  const auto server = start(recorder);
  std::optional<Client> client;
  {
    const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
    const NoFileDescriptors none;
    client.emplace(server->url(), socket);
    client->post("text", 4);
    const double before_ms = process_ms();
    std::this_thread::sleep_for(std::chrono::milliseconds(400));
    EXPECT_LT(process_ms() - before_ms, 100.0) << "processor time while nothing can be accepted";
  }
  auto accepted = recorder.accepted();
  EXPECT_EQ(accepted.first, "/a text");
  accepted.second({200, ""});
  accepted.second = {};
  EXPECT_TRUE(begins(client->answer(), "200"));
}

TEST(HttpServer, BodiesAreInvitedWhereClientsWaitForThat) {
  Recorder recorder;
  const auto server = start(recorder);
  Client client(server->url());
  client.send("POST /a HTTP/1.1\r\nHost: x\r\nExpect: 100-continue\r\nContent-Length: 4\r\n\r\n");
  client.send("body");
  auto accepted = recorder.accepted();
  accepted.second({204, ""});
  accepted.second = {};
  const std::string answer = client.answer();
  EXPECT_TRUE(begins(answer, "100 Continue\r\n\r\nHTTP/1.1 204")) << answer;
}

TEST(HttpServer, BodiesAreLimitedEachAndTogether) {
  Recorder recorder;
  const auto server = start(recorder);
  Client first(server->url()), second(server->url()), third(server->url()), fourth(server->url());
  first.post(std::string(100, 'x'), 100);
  auto accepted = recorder.accepted();
  second.post("x", 60);
  const std::string answer = second.answer();
  EXPECT_TRUE(begins(answer, "503")) << answer;
  EXPECT_NE(answer.find("Retry-After: 1"), std::string::npos) << answer;
  third.post("x", 101);
  EXPECT_TRUE(begins(third.answer(), "413"));
  accepted.second({200, ""});
  accepted.second = {};
  EXPECT_TRUE(begins(first.answer(), "200"));
  fourth.post(std::string(100, 'x'), 100);  // there is room again
  recorder.accepted().second({200, ""});
  EXPECT_TRUE(begins(fourth.answer(), "200"));
}

// Its refusals name their status, as an API would have it.
class Api final : public RequestHandler {
 public:
  std::optional<Response> refuse(const RequestHead&) override { return std::nullopt; }
  void handle(const RequestHead&, std::string, Respond respond) override { respond({200, "fine"}); }
  Response refusal(int status, std::string_view sentence) override {
    return {status, "{" + std::to_string(status) + ": " + std::string(sentence) + "}", "application/json"};
  }
};

TEST(HttpServer, TheHandlerWordsTheRefusalsOfTheServer) {
  Api api;
  const auto server = start(api);
  const std::string head = "POST /a HTTP/1.1\r\nHost: x\r\n";
  const std::vector<std::pair<std::string, std::string>> refused = {
      {head + "Transfer-Encoding: chunked\r\n\r\n1\r\nx\r\n0\r\n\r\n", "411"},
      {head + "Content-Length: 101\r\n\r\nx", "413"},
      {head + "Content-Length: -1\r\n\r\nx", "400"},
      {"GET /a HTTP/1.1\r\nContent-Length: 1\r\n\r\nx", "400"},
      {"GET / HTTP/1.1\r\n" + std::string(20000, 'x'), "431"},
      {"nonsense\r\n\r\n", "400"}};
  for (const auto& [request, status] : refused) {
    Client client(server->url());
    client.send(request);
    const std::string answer = client.answer();
    EXPECT_TRUE(begins(answer, status)) << answer;
    EXPECT_NE(answer.find("\r\nContent-Type: application/json\r\n"), std::string::npos) << answer;
    EXPECT_NE(answer.find("\r\n\r\n{" + status + ": "), std::string::npos) << answer;
  }
}

TEST(HttpServer, ASlowRequestIsDropped) {
  Recorder recorder;
  const auto server = start(recorder);
  Client slow(server->url());
  slow.post("never wh", 100);
  recorder.wait_until_one_was_late();
  EXPECT_EQ(slow.answer(), "");
}

TEST(HttpServer, RefusedRequestsAreAnsweredBeforeTheirBody) {
  Recorder recorder;
  const auto server = start(recorder);
  Client client(server->url());
  client.send("POST /refused HTTP/1.1\r\nHost: x\r\nContent-Length: 50\r\n\r\n");
  EXPECT_TRUE(begins(client.answer(), "403"));
}

TEST(HttpServer, TheEndWaitsForAcceptedRequests) {
  Recorder recorder;
  auto server = start(recorder);
  Client client(server->url());
  client.post("", 0);
  auto accepted = recorder.accepted();
  std::atomic<bool> ended = false;
  std::jthread ending([&] {
    server->finish(std::chrono::minutes(1));
    ended = true;
  });
  EXPECT_FALSE(ended);
  accepted.second({200, "done"});
  accepted.second = {};
  ending.join();
  server.reset();  // the answer must have been sent before
  EXPECT_TRUE(client.answer().ends_with("done"));
}

}  // namespace
}  // namespace bslam::web_server
