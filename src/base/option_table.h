// A flat table of the options of any struct with a `visit` (base/options.h): dotted keys, and conversion of values to
// and from text.
#pragma once

#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "base/options.h"
#include "base/result.h"

namespace bslam {

// A field of an enumeration type, with the type erased: values are positions in `names`.
struct EnumField {
  void* field = nullptr;
  int (*get)(const void* field) = nullptr;  // -1 if the value has no name
  void (*set)(void* field, int position) = nullptr;
  std::vector<std::string_view> names;
};

struct Option {
  std::string key;  // for example "features.per_image"
  std::variant<bool*, int*, double*, std::string*, EnumField> field;
  Range range;  // numeric options only
  std::string unit;
  std::string help;
  bool common = false;     // in the supported set of docs/settings.md; all others are advanced
  std::string former_key;  // the previous key, still accepted; empty if the option was never renamed
};

class OptionTable {
 public:
  // Refers to `options`, which must outlive the table and must not move. Every key occurs once.
  template <class Options>
  explicit OptionTable(Options& options) {
    Collector collector{*this, ""};
    Options::visit(options, collector);
    check_keys();
  }

  // Returns the options in the order of `visit`.
  const std::vector<Option>& options() const { return options_; }
  std::vector<std::string> keys() const;
  // Finds an option by its current or former key. Returns null if there is no such option.
  const Option* find(std::string_view key) const;

  // Sets one option from text. Errors: unknown key (with a suggestion if one is close), text of another type, NaN or
  // infinity, value out of range, unknown name of an enumeration. The field keeps its value on error; Error.file is
  // left empty. Setting an option by its former key works and adds a warning.
  Status set(std::string_view key, std::string_view text);

  // Returns one sentence for every former key that was set, in order of first use.
  const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  struct Collector {
    OptionTable& table;
    std::string prefix;  // empty, or ends with a dot

    template <class Field>
    void operator()(std::string_view name, Field& field, Range range, std::string_view unit, std::string_view help,
                    OptionNote note = {}) {
      Option option{prefix + std::string(name), {}, range, std::string(unit), std::string(help), note.common, {}};
      const bool complete = note.formerly.find('.') != std::string_view::npos;
      if (!note.formerly.empty()) option.former_key = (complete ? "" : prefix) + std::string(note.formerly);
      if constexpr (std::is_enum_v<Field>) {
        option.field = enum_field(field);
      } else {
        option.field = &field;
      }
      table.options_.push_back(std::move(option));
    }

    template <class Section>
    void section(std::string_view name, Section& section_options) {
      Collector nested{table, prefix + std::string(name) + "."};
      Section::visit(section_options, nested);
    }
  };

  template <class E>
  static EnumField enum_field(E& field) {
    EnumField out;
    out.field = &field;
    out.get = [](const void* p) {
      int position = 0;
      for (const EnumName<E>& entry : EnumNames<E>::kNames) {
        if (entry.value == *static_cast<const E*>(p)) return position;
        ++position;
      }
      return -1;
    };
    out.set = [](void* p, int position) {
      *static_cast<E*>(p) = EnumNames<E>::kNames[static_cast<std::size_t>(position)].value;
    };
    for (const EnumName<E>& entry : EnumNames<E>::kNames) out.names.push_back(entry.name);
    return out;
  }

  void check_keys() const;
  void warn_of_former_key(const Option& option);

  std::vector<Option> options_;
  std::vector<std::string> warnings_;
};

// Returns the value as text, from which `OptionTable::set` restores exactly the same value.
std::string value_text(const Option& option);

// Describes the accepted values: "an integer in [1, 20]", "one of: fast, realtime".
std::string expected_text(const Option& option);

}  // namespace bslam
