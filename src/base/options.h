// Options are declared once: name, default, range, unit and help text are given in the options struct of a stage. The
// YAML reader, the command line and the configuration written by a run all use its `visit` (see base/option_table.h).
//
//   enum class Pace { kFast, kRealtime };
//   template <>
//   struct EnumNames<Pace> {
//     static constexpr std::array<EnumName<Pace>, 2> kNames{{{Pace::kFast, "fast"}, {Pace::kRealtime, "realtime"}}};
//   };
//
//   struct FooOptions {
//     int rounds = 4;  // optimisation rounds, with reclassification of outliers between them
//     Pace pace = Pace::kFast;
//     BarOptions bar;  // nested options with their own visit function
//     template <class Self, class Visitor>
//     static void visit(Self& self, Visitor& visitor) {
//       visitor("rounds", self.rounds, Range{1, 20}, "", "optimisation rounds", OptionNote{.formerly = "repeats"});
//       visitor("pace", self.pace, Range{}, "", "speed at which images are fed", kCommon);
//       visitor.section("bar", self.bar);
//     }
//   };
//
// A visitor is called as `visitor(name, field, Range, unit, help)` for every option, which is a bool, int, double,
// std::string or an enumeration with EnumNames, and as `visitor.section(name, field)` for nested options, whose keys
// become "name.key". Names are snake_case without dots. An optional last argument is an OptionNote. `Self` is const if
// the visitor only reads.
#pragma once

#include <limits>
#include <string_view>

namespace bslam {

// Closed interval of accepted values of a number. Values outside are rejected with an error that names the option.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
};

// Properties of an option beyond its value.
struct OptionNote {
  bool common = false;  // in the supported set of docs/settings.md; all other options are advanced
  // Its previous name in the same section, or with a dot its complete previous key; still accepted for one release.
  std::string_view formerly = {};
};
inline constexpr OptionNote kCommon{.common = true};

template <class E>
struct EnumName {
  E value;
  std::string_view name;
};

// Specialised for every enumeration that is an option: `kNames` is an array of EnumName<E> with every value once.
template <class E>
struct EnumNames;

}  // namespace bslam
