#include "report/document.h"

#include <fmt/format.h>

#include <string_view>

#include "report/markup.h"

namespace bslam::report {
namespace {

constexpr std::string_view kStyle = R"(:root { color-scheme: light dark; --line: #d0d0d0; --head: #f2f2f2; }
@media (prefers-color-scheme: dark) { :root { --line: #444; --head: #2a2a2a; } }
body { font: 15px/1.5 system-ui, sans-serif; margin: 2em auto; max-width: 75em; padding: 0 1em; }
div { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { border: 1px solid var(--line); padding: .3em .6em; text-align: left; }
th { background: var(--head); }
)";

std::string markdown_cell(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '|') out += '\\';
    out += c == '\n' || c == '\r' ? ' ' : c;
  }
  return out;
}

std::string markdown_row(const std::vector<std::string>& cells) {
  std::string out = "|";
  for (const std::string& cell : cells) out += fmt::format(" {} |", markdown_cell(cell));
  return out + "\n";
}

std::string html_row(const std::vector<std::string>& cells, std::string_view tag) {
  std::string out = "<tr>";
  for (const std::string& cell : cells) out += fmt::format("<{0}>{1}</{0}>", tag, escaped(cell));
  return out + "</tr>\n";
}

}  // namespace

std::string markdown_text(const Document& document) {
  std::string out = fmt::format("# {}\n", document.title);
  for (const std::string& paragraph : document.paragraphs) out += fmt::format("\n{}\n", paragraph);
  for (const Table& table : document.tables) {
    out += fmt::format("\n## {}\n\n{}|", table.title, markdown_row(table.columns));
    for (std::size_t i = 0; i < table.columns.size(); ++i) out += "---|";
    out += "\n";
    for (const auto& row : table.rows) out += markdown_row(row);
  }
  if (!document.notes.empty()) out += "\n## Notes\n\n";
  for (const std::string& note : document.notes) out += fmt::format("- {}\n", note);
  return out;
}

std::string html_text(const Document& document) {
  std::string out = fmt::format(
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\"><title>{0}</title>\n<style>{1}</style></head><body>\n<h1>{0}</h1>\n",
      escaped(document.title), kStyle);
  for (const std::string& paragraph : document.paragraphs) out += fmt::format("<p>{}</p>\n", escaped(paragraph));
  for (const Table& table : document.tables) {
    out += fmt::format("<h2>{}</h2>\n<div><table>\n{}", escaped(table.title), html_row(table.columns, "th"));
    for (const auto& row : table.rows) out += html_row(row, "td");
    out += "</table></div>\n";
  }
  if (!document.notes.empty()) out += "<h2>Notes</h2>\n<ul>\n";
  for (const std::string& note : document.notes) out += fmt::format("<li>{}</li>\n", escaped(note));
  if (!document.notes.empty()) out += "</ul>\n";
  return out + "</body></html>\n";
}

}  // namespace bslam::report
