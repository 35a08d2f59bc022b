// Options declared once: name, default, range, unit and help stand in the stage's struct; YAML, the command line and the
// resolved configuration of a run all derive from one `visit`.
//
//   struct FooOptions {
//     int rounds = 4;  // solve rounds with re-classification between them
//     template <class Self, class Visitor>
//     static void visit(Self& self, Visitor& visitor) {
//       visitor("rounds", self.rounds, Range{1, 20}, "", "solve rounds with re-classification between them");
//     }
//   };
#pragma once

#include <limits>

namespace bslam {

// Closed interval of values that make sense; anything outside is refused with the key's name.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
};

}  // namespace bslam
