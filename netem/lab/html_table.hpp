// The lab's catalogues as HTML: tables under a verdict, readable on paper.
#pragma once

#include <string>
#include <vector>

#include "common/show/format.hpp"

namespace farhand {

inline constexpr const char* kTableStyle = R"(
body{font:14px/1.45 "Helvetica Neue",Arial,"Liberation Sans","DejaVu Sans",sans-serif;color:#1a1a1a;background:#fff;max-width:1180px;margin:24px auto;padding:0 16px}
h1{font-size:24px;margin:0 0 2px}h2{font-size:18px;margin:34px 0 6px;padding-bottom:4px;border-bottom:1px solid #ccc}p{margin:6px 0;max-width:86ch}
.verdict{border-left:8px solid;padding:10px 16px;margin:12px 0;background:#f6f6f6}.verdict b{font-size:19px}.ok{border-color:#2a7f4f}.failed{border-color:#111;background:#ececec}
table{border-collapse:collapse;margin:8px 0;font-size:12.5px;width:100%}th,td{text-align:left;vertical-align:top;padding:3px 12px 3px 0;border-bottom:1px solid #e3e3e3}th{border-bottom:1px solid #777}
td.n,th.n{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}tr.wrong td{font-weight:600;background:#ececec}
footer{margin-top:36px;border-top:2px solid #777;padding-top:8px;font-size:12.5px}
@media print{@page{margin:12mm;size:landscape}body{margin:0;max-width:none;font-size:10pt}tr{break-inside:avoid}h2{break-after:avoid}}
)";

inline std::string row(const std::vector<std::string>& cells, const char* tag = "td",
                       const std::string& attributes = "") {
  std::string out = "<tr" + attributes + ">";
  for (const std::string& cell : cells) {
    const bool number = cell.starts_with('\t');  // a leading tab marks a column of numbers
    out += std::string("<") + tag + (number ? " class=\"n\">" : ">") + escaped(number ? cell.substr(1) : cell) + "</" +
           tag + ">";
  }
  return out + "</tr>\n";
}

}  // namespace farhand
