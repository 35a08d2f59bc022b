#include "report/document.h"

#include <gtest/gtest.h>

namespace bslam::report {
namespace {

const Document kDocument{.title = "Title",
                         .paragraphs = {"Text."},
                         .tables = {{"Results", {"name", "value"}, {{"a|b", "<1>"}, {"line\nbreak", "2"}}}},
                         .notes = {"A note."}};

TEST(Document, MarkdownEscapesCells) {
  EXPECT_EQ(markdown_text(kDocument),
            "# Title\n\nText.\n\n## Results\n\n| name | value |\n|---|---|\n| a\\|b | <1> |\n| line break | 2 |\n\n"
            "## Notes\n\n- A note.\n");
}

TEST(Document, HtmlEscapesTextAndNeedsNoOtherFile) {
  const std::string html = html_text(kDocument);
  EXPECT_NE(html.find("<td>a|b</td><td>&lt;1&gt;</td>"), std::string::npos);
  EXPECT_NE(html.find("prefers-color-scheme: dark"), std::string::npos);
  EXPECT_EQ(html.find("http"), std::string::npos);
  EXPECT_EQ(html.find("src="), std::string::npos);
}

}  // namespace
}  // namespace bslam::report
