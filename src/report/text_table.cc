#include "report/text_table.h"

#include <fmt/format.h>

#include <algorithm>

namespace bslam::report {
namespace {

std::string line(const std::vector<std::string>& cells, const std::vector<std::size_t>& widths) {
  std::string out = fmt::format("{:<{}}", cells.front(), widths.front());
  for (std::size_t c = 1; c < cells.size(); ++c) out += fmt::format("  {:>{}}", cells[c], widths[c]);
  out.erase(out.find_last_not_of(' ') + 1);
  return out + "\n";
}

}  // namespace

std::string text_table(const Table& table) {
  std::vector<std::size_t> widths;
  for (const std::string& column : table.columns) widths.push_back(column.size());
  for (const auto& row : table.rows) {
    for (std::size_t c = 0; c < row.size(); ++c) widths[c] = std::max(widths[c], row[c].size());
  }
  std::string out = table.title + "\n" + line(table.columns, widths);
  for (const auto& row : table.rows) out += line(row, widths);
  return out;
}

}  // namespace bslam::report
