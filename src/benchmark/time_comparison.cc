#include "benchmark/time_comparison.h"

#include <fmt/format.h>

#include <algorithm>

namespace bslam::benchmark {
namespace {

constexpr const char* kNothing = "-";

// Smaller differences of a time or of memory are measurement noise.
double resolution_of(std::string_view name) {
  constexpr double kMs = 0.02, kS = 0.02, kMb = 1.0;
  if (name.ends_with("_ms")) return kMs;
  return name.ends_with("_s") ? kS : kMb;
}

Change change_of(const std::string& name, const Spread& before, const Spread& now, double margin) {
  const auto is_above = [&](const Spread& high, const Spread& low) {
    return high.median > (1 + margin) * low.median && high.median - low.median > resolution_of(name) &&
           high.min > low.max;
  };
  if (is_above(now, before)) return Change::kMore;
  return is_above(before, now) ? Change::kLess : Change::kNone;
}

std::string ratio_text(double before, double now) {
  return before > 0 ? fmt::format("{:.3f}", now / before) : kNothing;
}

// Calls compare(name, before, now) for every name in one or both of two lists of names and values; null if the value is
// missing.
template <class Item, class Name, class Compare>
void pair_up(const std::vector<Item>& before, const std::vector<Item>& now, const Name& name, const Compare& compare) {
  const auto find = [&](const std::vector<Item>& in, const std::string& wanted) -> const Item* {
    const auto found = std::ranges::find_if(in, [&](const Item& item) { return name(item) == wanted; });
    return found == in.end() ? nullptr : &*found;
  };
  for (const Item& item : now) compare(name(item), find(before, name(item)), &item);
  for (const Item& item : before) {
    if (!find(now, name(item))) compare(name(item), &item, static_cast<const Item*>(nullptr));
  }
}

class Comparison {
 public:
  explicit Comparison(double margin, bool exact) : margin_(margin), exact_(exact) {}

  void time(const std::string& name, const std::string& unit_of, const Spread* before, const Spread* now) {
    ComparedFigure figure{name, text(before), text(now), kNothing};
    if (before && now) {
      figure.ratio = ratio_text(before->median, now->median);
      figure.change = change_of(unit_of, *before, *now, margin_);
    }
    out_.figures.push_back(std::move(figure));
  }

  // Compares a count; nullopt if it was not counted or differs between runs. With `always`, a missing count is a
  // difference.
  void count(const std::string& name, std::optional<std::int64_t> before, std::optional<std::int64_t> now,
             bool always) {
    const auto shown = [](std::optional<std::int64_t> n) { return n ? std::to_string(*n) : kNothing; };
    ComparedFigure figure{name, shown(before), shown(now), kNothing};
    if (before && now) {
      figure.ratio = ratio_text(static_cast<double>(*before), static_cast<double>(*now));
      if (exact_ && *before != *now) figure.change = Change::kDiffers;
    } else if (exact_ && always && before.has_value() != now.has_value()) {
      figure.change = Change::kDiffers;
    }
    out_.figures.push_back(std::move(figure));
  }

  TimeComparison take() { return std::move(out_); }

 private:
  static std::string text(const Spread* s) { return s ? fmt::format("{:.3f}", s->median) : kNothing; }

  const double margin_;
  const bool exact_;
  TimeComparison out_;
};

void compare_stages(const TimeReport& before, const TimeReport& now, Comparison& comparison) {
  const auto name = [](const StageTimes& s) { return s.name; };
  pair_up(before.stages, now.stages, name, [&](const std::string& stage, const StageTimes* a, const StageTimes* b) {
    comparison.count(stage + ": calls", a ? a->calls : std::nullopt, b ? b->calls : std::nullopt, false);
    comparison.time(stage + ": median ms", "_ms", a ? &a->median_ms : nullptr, b ? &b->median_ms : nullptr);
    comparison.time(stage + ": 95 % ms", "_ms", a ? &a->p95_ms : nullptr, b ? &b->p95_ms : nullptr);
    comparison.time(stage + ": total ms", "_ms", a ? &a->total_ms : nullptr, b ? &b->total_ms : nullptr);
  });
}

std::vector<std::string> notes_of(const TimeConditions& before, const TimeConditions& now) {
  std::vector<std::string> notes;
  const auto note = [&](const char* what, const std::string& a, const std::string& b) {
    if (a != b)
      notes.push_back(fmt::format("{}: {} before, {} now; times and counts may differ for this reason", what, a, b));
  };
  note("processor", before.processor, now.processor);
  note("instructions", before.instructions, now.instructions);
  for (const TimeConditions* conditions : {&before, &now}) {
    if (conditions->mode == "sequential") continue;
    notes.push_back(fmt::format("counts vary from run to run in mode {}, and are not compared", conditions->mode));
    break;
  }
  return notes;
}

const char* mark(Change change) {
  switch (change) {
    case Change::kNone:
      break;
    case Change::kLess:
      return "less";
    case Change::kMore:
      return "MORE";
    case Change::kDiffers:
      return "DIFFERS";
  }
  return "";
}

}  // namespace

bool TimeComparison::worse() const {
  return std::ranges::any_of(
      figures, [](const ComparedFigure& f) { return f.change == Change::kMore || f.change == Change::kDiffers; });
}

TimeComparison compare_times(const TimeReport& before, const TimeReport& now, double margin) {
  Comparison comparison(margin, before.conditions.mode == "sequential" && now.conditions.mode == "sequential");
  const auto first = [](const auto& item) { return item.first; };
  pair_up(before.process, now.process, first, [&](const std::string& name, const auto* a, const auto* b) {
    if (name != "allocations_per_frame")  // it is already compared as a count
      comparison.time(spoken(name), name, a ? &a->second : nullptr, b ? &b->second : nullptr);
  });
  compare_stages(before, now, comparison);
  pair_up(before.work, now.work, first, [&](const std::string& name, const auto* a, const auto* b) {
    comparison.count(spoken(name), a ? std::optional(a->second) : std::nullopt,
                     b ? std::optional(b->second) : std::nullopt, true);
  });
  TimeComparison out = comparison.take();
  out.notes = notes_of(before.conditions, now.conditions);
  return out;
}

report::Table comparison_table(const TimeComparison& comparison) {
  report::Table table{"comparison", {"figure", "before", "now", "ratio", "change"}, {}};
  for (const ComparedFigure& f : comparison.figures)
    table.rows.push_back({f.name, f.before, f.now, f.ratio, mark(f.change)});
  return table;
}

}  // namespace bslam::benchmark
