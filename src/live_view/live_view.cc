#include "live_view/live_view.h"

#include <array>
#include <atomic>
#include <charconv>
#include <chrono>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "live_view/frame_data.h"
#include "live_view/live_record.h"
#include "map/rigs_of_map.h"
#include "report/page.h"
#include "session/report_data.h"

namespace bslam::live_view {

enum class Phase { kFeeding, kFinishing, kEnded };

// The data that the run passes to the view.
struct Mailbox {
  explicit Mailbox(std::size_t cameras) : frames(cameras) {}

  FrameLog frames;                                      // all frames since the view last read them
  std::shared_ptr<const session::ProcessedFrame> last;  // the newest processed frame
  std::optional<StageResults> results;
  Phase phase = Phase::kFeeding;
  std::size_t fed = 0;  // frames
  std::string report;   // data of the report, once the run has ended
};

namespace {

using nlohmann::ordered_json;
using std::chrono::milliseconds;

enum ChannelIndex : std::size_t { kState, kFrame, kRun };

std::vector<web_server::Channel> channels() {
  return {{"state", milliseconds(100), true}, {"frame", milliseconds(100)}, {"run", milliseconds(1000)}};
}

std::string_view name_of(Phase phase) {
  constexpr std::array<std::string_view, 3> kNames = {"feeding", "finishing", "ended"};
  return kNames[static_cast<std::size_t>(phase)];
}

std::string text_of(const ordered_json& json) {
  return json.dump(-1, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace

class LiveView::Content final : public web_server::Content {
 public:
  Content(Subject subject, session::RunControl& control)
      : subject_(std::move(subject)),
        control_(control),
        mailbox_(subject_.dataset.rig.size()),
        record_(subject_.dataset, subject_.config, subject_.loaded_keyframes),
        settings_(session::settings_json(subject_.config)) {}

  // ---- Called by the thread of the run

  void add(const InputFrame& frame, std::shared_ptr<const session::ProcessedFrame> processed,
           const system::System* system) {
    std::optional<StageResults> results;
    if (system && results_wanted_.exchange(false))
      results = StageResults{system->stage_runs(), system->loops(), system->maps_started()};
    const std::lock_guard lock(mutex_);
    mailbox_.frames.add(frame);
    ++mailbox_.fed;
    if (processed) mailbox_.last.swap(processed);
    if (results) mailbox_.results = std::move(results);
  }

  void enter(Phase phase, std::string report = {}) {
    const std::lock_guard lock(mutex_);
    mailbox_.phase = phase;
    mailbox_.report = std::move(report);
  }

  // ---- Called by the thread of the server

  std::string page() override {
    collect();
    ordered_json data{{"live", {{"data", subject_.dataset.name}, {"frames", subject_.dataset.frames.size()}}},
                      {"state", state_json()}};
    if (last_) {
      data["frame"] = frame_json(*last_, record_.seconds(last_->record.result.time_ns));
      data["run"] = run_json();
    }
    return report::page_with_data(text_of(data));
  }

  std::optional<std::string> update(std::size_t channel) override {
    collect();
    if (channel == kState) return changed_state();
    if (!last_) return std::nullopt;
    if (channel == kFrame) {
      if (std::exchange(shown_frame_, last_) == last_) return std::nullopt;
      return message("frame", frame_json(*last_, record_.seconds(last_->record.result.time_ns)));
    }
    const std::pair now(fed_, phase_);
    if (std::exchange(shown_run_, now) == now) return std::nullopt;
    // The data of the report are text already.
    if (!report_.empty()) return R"({"channel":"run","value":)" + report_ + "}";
    return message("run", run_json());
  }

  void received(std::string_view message) override {
    constexpr std::string_view kSpeed = "speed ";
    if (message == "pause") control_.pause();
    if (message == "resume") control_.resume();
    if (message == "step") control_.step();
    if (message.substr(0, kSpeed.size()) != kSpeed) return;
    const std::string_view number = message.substr(kSpeed.size());
    double speed = 0;
    const auto [end, error] = std::from_chars(number.data(), number.data() + number.size(), speed);
    if (error == std::errc() && end == number.data() + number.size()) control_.set_speed(speed);
  }

 private:
  static std::string message(std::string_view channel, ordered_json&& value) {
    return text_of({{"channel", channel}, {"value", std::move(value)}});
  }

  // Takes what has come since the last call. The lock is only held while pointers are exchanged.
  void collect() {
    FrameLog frames(subject_.dataset.rig.size());
    std::optional<StageResults> results;
    {
      const std::lock_guard lock(mutex_);
      std::swap(frames, mailbox_.frames);
      results.swap(mailbox_.results);
      last_ = mailbox_.last;
      fed_ = mailbox_.fed;
      phase_ = mailbox_.phase;
      if (report_.empty()) report_.swap(mailbox_.report);
    }
    record_.append(std::move(frames));
    if (results) results_ = *std::move(results);
  }

  ordered_json run_json() {
    results_wanted_ = true;
    const camera::Rig rig = map::cameras_of(last_->map->rig(), last_->first_camera, subject_.dataset.rig.size());
    ordered_json json = record_.run_json(*last_->map, rig, results_, subject_.up);
    json["command"] = subject_.command;
    json["truth"] = nullptr;
    json["settings"] = settings_;
    json["live"] = true;
    return json;
  }

  ordered_json state_json() const {
    const session::RunControl::State state = control_.state();
    return {{"phase", name_of(phase_)}, {"paused", state.paused}, {"speed", state.speed}, {"fed", fed_}};
  }

  std::optional<std::string> changed_state() {
    std::string text = message("state", state_json());
    if (text == shown_state_) return std::nullopt;
    shown_state_ = text;
    return text;
  }

  const Subject subject_;
  session::RunControl& control_;
  std::atomic<bool> results_wanted_ = true;
  std::mutex mutex_;
  Mailbox mailbox_;  // guarded by mutex_
  // The next ones belong to the thread of the server.
  LiveRecord record_;
  const ordered_json settings_;
  StageResults results_;
  std::shared_ptr<const session::ProcessedFrame> last_, shown_frame_;
  std::size_t fed_ = 0;
  Phase phase_ = Phase::kFeeding;
  std::pair<std::size_t, Phase> shown_run_;
  std::string report_, shown_state_;
};

LiveView::LiveView(std::unique_ptr<Content> content) : content_(std::move(content)) {}
LiveView::~LiveView() = default;

Result<std::unique_ptr<LiveView>> LiveView::start(const web_server::ServerOptions& options, Subject subject,
                                                  session::RunControl& control) {
  auto view = std::unique_ptr<LiveView>(new LiveView(std::make_unique<Content>(std::move(subject), control)));
  auto server = web_server::Server::start(options, channels(), *view->content_);
  if (!server) return server.error();
  view->server_ = *std::move(server);
  return view;
}

const std::string& LiveView::url() const { return server_->url(); }
bool LiveView::is_watched() const { return server_->is_watched(); }

void LiveView::processed(session::ProcessedFrame&& frame, const system::System& system) {
  const auto shared = std::make_shared<const session::ProcessedFrame>(std::move(frame));
  const tracking::FrameRecord& record = shared->record;
  InputFrame input{record.result.time_ns, &record, shared->read_ms, 0};
  if (record.relocalisation) input.relocalised_with_ns = system.keyframe_time(record.relocalisation->matched_keyframe);
  content_->add(input, shared, &system);
}

void LiveView::dropped(TimeNs time_ns, double read_ms) {
  content_->add({time_ns, nullptr, read_ms, 0}, nullptr, nullptr);
}

void LiveView::fed() { content_->enter(Phase::kFinishing); }

void LiveView::end(std::string report_json) {
  content_->enter(Phase::kEnded, std::move(report_json));
  server_->finish(std::chrono::seconds(1));
}

}  // namespace bslam::live_view
