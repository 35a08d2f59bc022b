// Writes and reads time.json.
#include <nlohmann/json.hpp>

#include "benchmark/time_report.h"

namespace bslam::benchmark {
namespace {

using nlohmann::json;
using nlohmann::ordered_json;

constexpr int kSchema = 1;

ordered_json json_of(const Spread& s) { return {{"median", s.median}, {"min", s.min}, {"max", s.max}}; }

// Text of a value for an error message; only the type of a container.
std::string shown(const ordered_json& value) { return value.is_structured() ? value.type_name() : value.dump(); }

// Reads a JSON object, and keeps the first error.
class Reader {
 public:
  Reader(const ordered_json& value, std::string file) : value_(value), file_(std::move(file)) {}

  // The value of a key, or null after an error.
  const ordered_json& at(const std::string& key, const char* expected, bool (*fits)(const ordered_json&)) {
    static const ordered_json kNull;
    const auto found = value_.find(key);
    if (found != value_.end() && fits(*found)) return *found;
    fail(key, found == value_.end() ? "nothing" : shown(*found), expected);
    return kNull;
  }
  std::string text(const std::string& key) {
    const ordered_json& found = at(key, "a text", [](const ordered_json& v) { return v.is_string(); });
    return found.is_null() ? "" : found.get<std::string>();
  }
  double number(const std::string& key) {
    const ordered_json& found = at(key, "a number", [](const ordered_json& v) { return v.is_number(); });
    return found.is_null() ? 0.0 : found.get<double>();
  }
  std::int64_t count(const std::string& key) {
    const ordered_json& found = at(key, "a whole number", [](const ordered_json& v) { return v.is_number_integer(); });
    return found.is_null() ? 0 : found.get<std::int64_t>();
  }
  bool is_null(const std::string& key) const { return value_.contains(key) && value_.at(key).is_null(); }
  // Calls read(reader, name) with a reader of an object within this one.
  template <class Read>
  void inside(const std::string& key, const Read& read) {
    const ordered_json& found = at(key, "an object", [](const ordered_json& v) { return v.is_object(); });
    if (!status_) return;
    Reader reader(found, file_);
    reader.path_ = path_ + key + ".";
    read(reader);
    if (!reader.status_) status_ = reader.status_;
  }
  template <class Read>
  void each(const Read& read) {
    for (const auto& [key, value] : value_.items()) {
      if (status_) read(key);
    }
  }
  Spread spread(const std::string& key) {
    Spread out;
    inside(key, [&](Reader& r) { out = {r.number("median"), r.number("min"), r.number("max")}; });
    return out;
  }
  void fail(const std::string& key, std::string found, const char* expected) {
    constexpr std::size_t kLongest = 60;
    if (found.size() > kLongest) found = found.substr(0, kLongest) + "...";
    if (status_) status_ = Error{file_, path_ + key, std::move(found), expected};
  }
  const Status& status() const { return status_; }

 private:
  const ordered_json& value_;
  std::string file_, path_;
  Status status_;
};

void read_figures(Reader& r, TimeReport& report) {
  r.inside("process", [&](Reader& process) {
    process.each([&](const std::string& name) { report.process.emplace_back(name, process.spread(name)); });
  });
  r.inside("stages", [&](Reader& stages) {
    stages.each([&](const std::string& name) {
      stages.inside(name, [&](Reader& s) {
        std::optional<std::int64_t> calls;
        if (!s.is_null("calls")) calls = s.count("calls");
        report.stages.push_back({name, calls, s.spread("median_ms"), s.spread("p95_ms"), s.spread("total_ms")});
      });
    });
  });
  r.inside("work", [&](Reader& work) {
    work.each([&](const std::string& name) { report.work.emplace_back(name, work.count(name)); });
  });
  r.inside("varying", [&](Reader& varying) {
    varying.each([&](const std::string& name) {
      varying.inside(name, [&](Reader& v) { report.varying.push_back({name, v.count("min"), v.count("max")}); });
    });
  });
}

}  // namespace

std::string time_json(const TimeReport& report) {
  const TimeConditions& c = report.conditions;
  ordered_json process = ordered_json::object(), stages = ordered_json::object(), work = ordered_json::object(),
               varying = ordered_json::object();
  for (const auto& [name, value] : report.process) process[name] = json_of(value);
  for (const StageTimes& s : report.stages) {
    stages[s.name] = {{"calls", s.calls ? ordered_json(*s.calls) : ordered_json()},
                      {"median_ms", json_of(s.median_ms)},
                      {"p95_ms", json_of(s.p95_ms)},
                      {"total_ms", json_of(s.total_ms)}};
  }
  for (const auto& [name, value] : report.work) work[name] = value;
  for (const VaryingCount& v : report.varying) varying[v.name] = {{"min", v.min}, {"max", v.max}};
  const ordered_json out = {{"bslam_time", kSchema},
                            {"version", c.version},
                            {"data", c.data},
                            {"mode", c.mode},
                            {"command", c.command},
                            {"processor", c.processor},
                            {"instructions", c.instructions},
                            {"runs", report.runs},
                            {"process", process},
                            {"stages", stages},
                            {"work", work},
                            {"varying", varying}};
  return out.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

Result<TimeReport> parse_time_json(const std::string& text, const std::string& file) {
  const ordered_json value = ordered_json::parse(text, nullptr, false);
  if (!value.is_object()) return Error{file, "", "no JSON object", "a time.json of bslam bench --time"};
  Reader r(value, file);
  if (const auto schema = r.count("bslam_time"); r.status() && schema != kSchema)
    r.fail("bslam_time", std::to_string(schema), "1, the version of the file that this program reads");
  TimeReport report;
  report.conditions = {r.text("version"), r.text("data"),      r.text("mode"),
                       r.text("command"), r.text("processor"), r.text("instructions")};
  report.runs = static_cast<int>(r.count("runs"));
  read_figures(r, report);
  if (!r.status()) return r.status().error();
  return report;
}

}  // namespace bslam::benchmark
