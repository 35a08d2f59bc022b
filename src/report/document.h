// A short report of text and tables, as Markdown and as one HTML file that needs no other file.
#pragma once

#include <string>
#include <vector>

namespace bslam::report {

struct Table {
  std::string title;
  std::vector<std::string> columns;
  std::vector<std::vector<std::string>> rows;  // each as long as `columns`
};

struct Document {
  std::string title;
  std::vector<std::string> paragraphs;  // above the tables
  std::vector<Table> tables;
  std::vector<std::string> notes;  // a list below the tables
};

// Returns the document as Markdown. Vertical bars and line breaks in cells are escaped.
std::string markdown_text(const Document& document);

// Returns the document as HTML, which follows the reader's choice of light or dark colours. All texts are escaped.
std::string html_text(const Document& document);

}  // namespace bslam::report
