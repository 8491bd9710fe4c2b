#include "emulator/nodes/cia301/object_table.h"

#include <algorithm>

namespace walkman::nodes {
namespace {

constexpr std::string_view kHighestSub = "Highest sub-index supported";

EntryRow count(std::size_t highest_sub) {
  return number<std::uint8_t>(kHighestSub, Access::kConst, static_cast<std::uint8_t>(highest_sub));
}

ObjectRow structured(std::uint16_t index, ObjectCode code, std::string_view name,
                     std::vector<EntryRow> entries) {
  ObjectRow row{index, code, name};
  row.zero = count(entries.size());
  row.entries = std::move(entries);
  return row;
}

}  // namespace

EntryRow EntryRow::one_of(std::initializer_list<int> values) const {
  EntryRow row = within(std::min(values), std::max(values));
  for (const int value : values) row.allowed |= std::uint64_t{1} << static_cast<unsigned>(value);
  return row;
}

EntryRow text(std::string_view name) { return {name, DataType::kVisibleString, Access::kConst}; }

EntryRow string(std::string_view name, std::size_t longest) {
  EntryRow row{name, DataType::kVisibleString, Access::kReadWrite};
  row.longest = longest;
  return row;
}

EntryRow domain(std::string_view name) { return {name, DataType::kDomain, Access::kReadOnly}; }

const EntryRow* ObjectRow::find(std::uint8_t sub) const noexcept {
  if (sub == 0) return &zero;
  if (!each.name.empty()) return &each;
  if (sub > entries.size() || entries[sub - 1U].name.empty()) return nullptr;
  return &entries[sub - 1U];
}

ObjectRow variable(std::uint16_t index, const EntryRow& value) {
  const bool domain = value.type == DataType::kDomain;
  return {index, domain ? ObjectCode::kDomain : ObjectCode::kVariable, value.name, value};
}

ObjectRow array(std::uint16_t index, std::string_view name, std::vector<EntryRow> entries) {
  return structured(index, ObjectCode::kArray, name, std::move(entries));
}

ObjectRow record(std::uint16_t index, std::string_view name, std::vector<EntryRow> entries) {
  return structured(index, ObjectCode::kRecord, name, std::move(entries));
}

ObjectRow array_of(std::uint16_t index, std::string_view name, const EntryRow& each,
                   std::uint8_t highest_sub) {
  ObjectRow row{index, ObjectCode::kArray, name};
  row.zero = count(highest_sub);
  row.each = each;
  row.each_count = highest_sub;
  return row;
}

}  // namespace walkman::nodes
