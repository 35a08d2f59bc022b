// Options declared once: name, default, range, unit and help stand in the stage's struct; YAML, the command line and
// the resolved configuration of a run all derive from one `visit` (see base/option_table.h).
//
//   enum class Pace { kFast, kRealtime };
//   template <>
//   struct EnumNames<Pace> {
//     static constexpr std::array<EnumName<Pace>, 2> kNames{{{Pace::kFast, "fast"}, {Pace::kRealtime, "realtime"}}};
//   };
//
//   struct FooOptions {
//     int rounds = 4;  // solve rounds with re-classification between them
//     Pace pace = Pace::kFast;
//     BarOptions bar;  // options of a part, with a visit of its own
//     template <class Self, class Visitor>
//     static void visit(Self& self, Visitor& visitor) {
//       visitor("rounds", self.rounds, Range{1, 20}, "", "solve rounds with re-classification between them");
//       visitor("pace", self.pace, Range{}, "", "how images are fed");
//       visitor.section("bar", self.bar);
//     }
//   };
//
// A visitor is called as `visitor(name, field, Range, unit, help)` for every leaf: a field of type bool, int, double,
// std::string or an enumeration with EnumNames; and as `visitor.section(name, field)` for nested options, whose keys
// become "name.key". Names are snake_case without dots. `Self` is const where the visitor only reads.
#pragma once

#include <limits>
#include <string_view>

namespace bslam {

// Closed interval of values that make sense; anything outside is refused with the key's name. Numbers only.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
};

template <class E>
struct EnumName {
  E value;
  std::string_view name;
};

// To be specialised for enumerations that are options: `kNames`, an array of EnumName<E> with every value once.
template <class E>
struct EnumNames;

}  // namespace bslam
