#include "apps/shared/html_page.h"

#include <fmt/format.h>

namespace walkman::apps {
namespace {

constexpr std::string_view kSharedStyle =
    R"(body{font:15px/1.45 system-ui,sans-serif;color:#222;max-width:62rem;margin:2rem auto;padding:0 1rem}
table{border-collapse:collapse;margin:.6rem 0 1.4rem}
th,td{padding:.18rem .6rem;text-align:right;border-bottom:1px solid #ddd;font-variant-numeric:tabular-nums}
th:first-child,td:first-child{text-align:left}
.bad{color:#b00}
h2{margin-top:2.2rem}
)";

}  // namespace

std::string page_head(std::string_view title, std::string_view style) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{}</title><style>\n{}{}"
      "</style></head><body>\n",
      escaped(title), kSharedStyle, style);
}

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '<':
        out += "&lt;";
        break;
      case '&':
        out += "&amp;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string table_head(const std::vector<std::string>& headings) {
  std::string out = "<table><tr>";
  for (const std::string& heading : headings) out += fmt::format("<th>{}</th>", heading);
  return out + "</tr>\n";
}

}  // namespace walkman::apps
