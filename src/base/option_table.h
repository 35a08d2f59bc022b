// A flat table over any struct of options that has a `visit` (base/options.h). Options are addressed by dotted keys,
// and their values are converted to and from text.
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

// A type-erased field of an enumeration type. Values are given as positions in `names`.
struct EnumField {
  void* field = nullptr;
  int (*get)(const void* field) = nullptr;  // returns -1 if the value has no name
  void (*set)(void* field, int position) = nullptr;
  std::vector<std::string_view> names;
};

struct Option {
  std::string key;  // for example "features.per_image"
  std::variant<bool*, int*, double*, std::string*, EnumField> field;
  Range range;  // numeric options only
  std::string unit;
  std::string help;
};

class OptionTable {
 public:
  // Keeps references into `options`, which must outlive the table and must not move. Every key must be unique.
  template <class Options>
  explicit OptionTable(Options& options) {
    Collector collector{*this, ""};
    Options::visit(options, collector);
    check_keys();
  }

  // The options in the order of `visit`.
  const std::vector<Option>& options() const { return options_; }
  std::vector<std::string> keys() const;
  const Option* find(std::string_view key) const;

  // Sets one option from text. Errors: an unknown key (the message suggests the nearest one), text of the wrong type,
  // NaN or infinity, a value out of range, an unknown enumerator. On error the field is unchanged. Error::file is left
  // empty.
  Status set(std::string_view key, std::string_view text);

 private:
  struct Collector {
    OptionTable& table;
    std::string prefix;  // empty, or ends with a dot

    template <class Field>
    void operator()(std::string_view name, Field& field, Range range, std::string_view unit, std::string_view help) {
      Option option{prefix + std::string(name), {}, range, std::string(unit), std::string(help)};
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

  std::vector<Option> options_;
};

// Returns the value as text that OptionTable::set parses back exactly.
std::string value_text(const Option& option);

// Describes the accepted values, for example "an integer in [1, 20]" or "one of: fast, realtime".
std::string expected_text(const Option& option);

}  // namespace bslam
