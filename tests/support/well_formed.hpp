// Whether a page is sound, without a browser.
#pragma once

#include <gtest/gtest.h>

#include <regex>
#include <stack>
#include <string>

namespace farhand {

// Every tag is closed in order, attributes are quoted, no stray < or &: what an XML parser would demand.
inline testing::AssertionResult well_formed(const std::string& html) {
  static const std::regex kTag(R"re(<(/?)([A-Za-z][A-Za-z0-9]*)((?:\s+[A-Za-z0-9:-]+="[^"<]*")*)\s*(/?)>)re");
  std::stack<std::string> open;
  for (std::size_t k = html.find('>') + 1; k < html.size();) {  // behind the document type
    if (html[k] == '&') {
      const auto end = html.find(';', k);
      if (end == std::string::npos || end - k > 6)
        return testing::AssertionFailure() << "stray & at " << html.substr(k, 40);
    }
    if (html[k] != '<') {
      ++k;
      continue;
    }
    const std::size_t end = html.find('>', k);
    const std::string tag = end == std::string::npos ? html.substr(k) : html.substr(k, end - k + 1);
    // Path data may be long and std::regex recurses: it is checked without its numbers.
    const std::string shorter = std::regex_replace(tag.substr(0, 200), std::regex(" d=\"[^\"]*\"?"), "");
    std::smatch match;
    const bool path = tag.compare(0, 5, "<path") == 0;
    if (path) {
      if (tag.substr(tag.size() - 2) != "/>") return testing::AssertionFailure() << "open path " << tag.substr(0, 80);
    } else if (!std::regex_match(tag, match, kTag)) {
      return testing::AssertionFailure() << "bad tag " << tag.substr(0, 200);
    } else if (!match[1].str().empty()) {
      if (open.empty() || open.top() != match[2]) return testing::AssertionFailure() << "unexpected " << tag;
      open.pop();
    } else if (match[4].str().empty()) {
      open.push(match[2]);
    }
    k = end + 1;
  }
  if (!open.empty()) return testing::AssertionFailure() << "never closed: " << open.top();
  return testing::AssertionSuccess();
}

}  // namespace farhand
