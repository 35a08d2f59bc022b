// Each option is declared once, in the struct of its stage, with its name, default, range, unit and help text. YAML
// files, the command line and the resolved configuration of a run are all derived from the function `visit` (see
// base/option_table.h).
//
//   enum class Pace { kFast, kRealtime };
//   template <>
//   struct EnumNames<Pace> {
//     static constexpr std::array<EnumName<Pace>, 2> kNames{{{Pace::kFast, "fast"}, {Pace::kRealtime, "realtime"}}};
//   };
//
//   struct FooOptions {
//     int rounds = 4;  // solver rounds, with outlier classification between them
//     Pace pace = Pace::kFast;
//     BarOptions bar;  // nested options, with a `visit` of their own
//     template <class Self, class Visitor>
//     static void visit(Self& self, Visitor& visitor) {
//       visitor("rounds", self.rounds, Range{1, 20}, "", "solver rounds, with outlier classification between them");
//       visitor("pace", self.pace, Range{}, "", "how images are fed");
//       visitor.section("bar", self.bar);
//     }
//   };
//
// A visitor is called as `visitor(name, field, Range, unit, help)` for every option of type bool, int, double,
// std::string or an enumeration with EnumNames, and as `visitor.section(name, field)` for nested options, whose keys
// become "name.key". Names are snake_case without dots. `Self` is const if the visitor only reads.
#pragma once

#include <limits>
#include <string_view>

namespace bslam {

// Closed interval of valid values of a numeric option. Values outside are rejected with an error that names the key.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
};

template <class E>
struct EnumName {
  E value;
  std::string_view name;
};

// Specialised for every enumeration used as an option: `kNames` is an array of EnumName<E> that lists every value once.
template <class E>
struct EnumNames;

}  // namespace bslam
