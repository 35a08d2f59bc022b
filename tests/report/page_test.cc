#include "report/page.h"

#include <gtest/gtest.h>

#include <regex>
#include <string>

namespace bslam::report {
namespace {

const std::string kBegin = R"(<script type="application/json" id="bslam-data">)";

// The text of the element with the data.
std::string data_of(const std::string& page) {
  const std::size_t begin = page.find(kBegin) + kBegin.size();
  return page.substr(begin, page.find("</script>", begin) - begin);
}

TEST(Page, WithoutDataHasAnEmptyPlaceForThem) { EXPECT_EQ(data_of(std::string(empty_page())), "null"); }

TEST(Page, ContainsTheDataAndNothingElseChanges) {
  const std::string page = page_with_data(R"({"a":[1,2]})");
  EXPECT_EQ(data_of(page), R"({"a":[1,2]})");
  std::string without = page;
  without.replace(page.find(kBegin) + kBegin.size(), data_of(page).size(), "null");
  EXPECT_EQ(without, empty_page());
}

TEST(Page, DataCannotEndTheirElement) {
  const std::string page = page_with_data(R"({"name":"</script><!--<script>alert(1)</script>"})");
  EXPECT_EQ(data_of(page), R"({"name":"\u003c/script>\u003c!--\u003cscript>alert(1)\u003c/script>"})");
  EXPECT_EQ(page.find("<script>alert"), std::string::npos);
}

TEST(Page, LoadsNothingFromOutside) {
  const std::string page(empty_page());
  for (const char* pattern : {R"((src|href)\s*=\s*["']?\s*(https?:)?//)", R"(url\(\s*["']?(https?:)?//)", "@import"})
    EXPECT_FALSE(std::regex_search(page, std::regex(pattern, std::regex::icase | std::regex::optimize))) << pattern;
}

TEST(Page, NamesTheLicencesOfItsLibraries) {
  for (const char* text : {"three.js authors", "Leon Sorokin", "MIT License"})
    EXPECT_NE(empty_page().find(text), std::string_view::npos) << text;
}

}  // namespace
}  // namespace bslam::report
