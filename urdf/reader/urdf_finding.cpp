#include "urdf/reader/urdf_finding.h"

#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "urdf/reader/utf8.h"

namespace walkman {

std::string to_sentence(const std::string& file, const UrdfFinding& finding) {
  return one_line(fmt::format("{}:{}: {}: {}", file, finding.line, finding.element, finding.reason));
}

UrdfFindings::UrdfFindings(std::string file, OnFinding on_finding)
    : file_(std::move(file)), on_finding_(on_finding) {}

void UrdfFindings::add(int line, std::string element, std::string reason) {
  all_.push_back({line, std::move(element), std::move(reason)});
  if (on_finding_ == OnFinding::kThrow) throw std::runtime_error(to_sentence(file_, all_.back()));
}

}  // namespace walkman
