#include "base/option_table.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <set>

#include "base/assert.h"
#include "base/nearest_name.h"
#include "base/number_text.h"

namespace bslam {
namespace {

template <class... Cases>
struct Overloaded : Cases... {
  using Cases::operator()...;
};
template <class... Cases>  // clang before 17 does not deduce the template arguments of an aggregate
Overloaded(Cases...)->Overloaded<Cases...>;

std::string bound_text(double bound, bool integer) {
  return integer ? std::to_string(static_cast<long long>(bound)) : format_double(bound);
}

std::string range_text(const Range& range, bool integer) {
  const bool low = std::isfinite(range.low), high = std::isfinite(range.high);
  if (low && high) return " in [" + bound_text(range.low, integer) + ", " + bound_text(range.high, integer) + "]";
  if (low) return " of at least " + bound_text(range.low, integer);
  if (high) return " of at most " + bound_text(range.high, integer);
  return "";
}

bool within(double value, const Range& range) { return value >= range.low && value <= range.high; }

// Each overload parses the text and stores the value, or returns false and leaves the field unchanged.
bool store(bool* field, const Range&, std::string_view text) {
  if (text != "true" && text != "false") return false;
  *field = text == "true";
  return true;
}

bool store(int* field, const Range& range, std::string_view text) {
  const auto value = parse_integer(text);
  if (!value || *value < std::numeric_limits<int>::min() || *value > std::numeric_limits<int>::max()) return false;
  if (!within(static_cast<double>(*value), range)) return false;
  *field = static_cast<int>(*value);
  return true;
}

bool store(double* field, const Range& range, std::string_view text) {
  const auto value = parse_double(text);
  if (!value || !within(*value, range)) return false;
  *field = *value;
  return true;
}

bool store(std::string* field, const Range&, std::string_view text) {
  *field = text;
  return true;
}

bool store(const EnumField& field, const Range&, std::string_view text) {
  const auto name = std::find(field.names.begin(), field.names.end(), text);
  if (name == field.names.end()) return false;
  field.set(field.field, static_cast<int>(name - field.names.begin()));
  return true;
}

std::string suggestion_text(const std::string& nearest) {
  if (nearest.empty()) return "; 'bslam settings --common' lists the commonly changed settings";
  return "; did you mean '" + nearest + "'?";
}

}  // namespace

void OptionTable::check_keys() const {
  std::set<std::string> seen;
  for (const Option& option : options_) {
    BSLAM_ASSERT(seen.insert(option.key).second, "option keys must be declared once");
    if (!option.former_key.empty()) {
      BSLAM_ASSERT(seen.insert(option.former_key).second,
                   "former keys must be declared once and must not be current keys");
    }
  }
}

std::vector<std::string> OptionTable::keys() const {
  std::vector<std::string> keys;
  for (const Option& option : options_) keys.push_back(option.key);
  return keys;
}

const Option* OptionTable::find(std::string_view key) const {
  const auto found = std::find_if(options_.begin(), options_.end(), [&](const Option& o) {
    return o.key == key || (!o.former_key.empty() && o.former_key == key);
  });
  return found == options_.end() ? nullptr : &*found;
}

void OptionTable::warn_of_former_key(const Option& option) {
  std::string warning = "setting '" + option.former_key + "' is now called '" + option.key +
                        "'; the old name will stop working in the next release";
  if (std::find(warnings_.begin(), warnings_.end(), warning) == warnings_.end()) {
    warnings_.push_back(std::move(warning));
  }
}

Status OptionTable::set(std::string_view key, std::string_view text) {
  const Option* option = find(key);
  if (option == nullptr) {
    return Error{"", std::string(key), "an unknown key", "a setting of 'bslam settings'",
                 "unknown setting '" + std::string(key) + "'" + suggestion_text(nearest_name(key, keys()))};
  }
  if (key == option->former_key) warn_of_former_key(*option);
  const bool stored = std::visit([&](const auto& field) { return store(field, option->range, text); }, option->field);
  if (stored) return {};
  return Error{"", option->key, text.empty() ? "nothing" : std::string(text), expected_text(*option)};
}

std::string value_text(const Option& option) {
  return std::visit(Overloaded{[](const bool* field) { return std::string(*field ? "true" : "false"); },
                               [](const int* field) { return std::to_string(*field); },
                               [](const double* field) { return format_double(*field); },
                               [](const std::string* field) { return *field; },
                               [](const EnumField& field) {
                                 const int position = field.get(field.field);
                                 BSLAM_ASSERT(position >= 0, "every value of an option's enumeration must have a name");
                                 return std::string(field.names[static_cast<std::size_t>(position)]);
                               }},
                    option.field);
}

std::string expected_text(const Option& option) {
  return std::visit(Overloaded{[](const bool*) { return std::string("true or false"); },
                               [&](const int*) { return "an integer" + range_text(option.range, true); },
                               [&](const double*) { return "a number" + range_text(option.range, false); },
                               [](const std::string*) { return std::string("text"); },
                               [](const EnumField& field) {
                                 std::string text = "one of:";
                                 for (const std::string_view name : field.names) {
                                   text += (text.back() == ':' ? " " : ", ") + std::string(name);
                                 }
                                 return text;
                               }},
                    option.field);
}

}  // namespace bslam
