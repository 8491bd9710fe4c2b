#include "emulator/datasheets/eds_writer.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

namespace walkman::datasheets {
namespace {

// Date of the device types' revision, not of the run: the same devices give the same file.
constexpr const char* kDate = "11-21-2026";
constexpr const char* kTime = "12:00PM";

/// Bit rates of CiA 301 in kbit/s; the emulated bus and LSS support them all.
constexpr std::array kBitRates{10, 20, 50, 125, 250, 500, 800, 1000};

enum class Part { kMandatory, kOptional, kManufacturer };

Part part_of(std::uint16_t index) {
  if (index == 0x1000 || index == 0x1001 || index == 0x1018) return Part::kMandatory;
  return index >= 0x2000 && index < 0x6000 ? Part::kManufacturer : Part::kOptional;
}

std::uint32_t identity(const nodes::ObjectDictionary& dictionary, std::uint8_t sub) {
  const nodes::Entry* entry = dictionary.find(0x1018, sub);
  return entry == nullptr ? 0 : entry->default_raw;
}

std::size_t count_objects(std::span<const ObjectEntries> objects, std::uint16_t first, std::uint16_t last) {
  return static_cast<std::size_t>(std::count_if(objects.begin(), objects.end(), [&](const ObjectEntries& o) {
    return first <= o.index && o.index <= last;
  }));
}

void append_comments(std::vector<std::string>& lines, const nodes::ObjectDictionary& dictionary) {
  std::vector<std::string> comments{
      "Generated from the object dictionary of the emulated device.",
      "Values without a default differ between devices of this type.",
      "REAL32 values have no default here: readers do not agree on how to write them."};
  if (dictionary.find(0x607A, 0) != nullptr) {
    comments.insert(
        comments.end(),
        {"A joint does not start at 0. In mode 8 read 6064h first and write it to 607Ah,",
         "and enable operation then; a first target of 0 is a step, run at 607Fh or ended by 8611h."});
  }
  lines.insert(lines.end(), {"", "[Comments]", fmt::format("Lines={}", comments.size())});
  for (std::size_t i = 0; i < comments.size(); ++i)
    lines.push_back(fmt::format("Line{}={}", i + 1, comments[i]));
  lines.emplace_back();
}

void append_head(std::vector<std::string>& lines, const EdsTitle& title,
                 const nodes::ObjectDictionary& dictionary, std::span<const ObjectEntries> objects) {
  lines.insert(lines.end(), {"[FileInfo]", "FileName=" + title.file_name, "FileVersion=1", "FileRevision=0",
                             "EDSVersion=4.0", "Description=" + title.description,
                             std::string("CreationTime=") + kTime, std::string("CreationDate=") + kDate,
                             "CreatedBy=walkman-hil", std::string("ModificationTime=") + kTime,
                             std::string("ModificationDate=") + kDate, "ModifiedBy=walkman-hil", ""});
  lines.insert(
      lines.end(),
      {"[DeviceInfo]", "VendorName=walkman-hil",
       fmt::format("VendorNumber=0x{:08X}", identity(dictionary, 1)), "ProductName=" + title.product,
       fmt::format("ProductNumber=0x{:08X}", identity(dictionary, 2)),
       fmt::format("RevisionNumber=0x{:08X}", identity(dictionary, 3)), "OrderCode=" + title.order_code});
  for (const int rate : kBitRates) lines.push_back(fmt::format("BaudRate_{}=1", rate));
  lines.insert(lines.end(),
               {"SimpleBootUpMaster=0", "SimpleBootUpSlave=1", "Granularity=8", "DynamicChannelsSupported=0",
                "GroupMessaging=0", fmt::format("NrOfRXPDO={}", count_objects(objects, 0x1400, 0x15FF)),
                fmt::format("NrOfTXPDO={}", count_objects(objects, 0x1800, 0x19FF)), "LSS_Supported=1", ""});
  // Dummy entries of 8, 16 and 32 bits; PDOs are mapped in whole bytes, so there is none of one bit.
  lines.emplace_back("[DummyUsage]");
  for (int type = 1; type <= 7; ++type)
    lines.push_back(fmt::format("Dummy{:04X}={}", type, type == 1 ? 0 : 1));
  append_comments(lines, dictionary);
}

void append_part(std::vector<std::string>& lines, Part part, const char* section,
                 std::span<const ObjectEntries> objects, std::span<const EdsDevice> devices) {
  std::vector<const ObjectEntries*> listed;
  for (const ObjectEntries& object : objects)
    if (part_of(object.index) == part) listed.push_back(&object);
  lines.push_back(fmt::format("[{}]", section));
  lines.push_back(fmt::format("SupportedObjects={}", listed.size()));
  for (std::size_t i = 0; i < listed.size(); ++i)
    lines.push_back(fmt::format("{}=0x{:04X}", i + 1, listed[i]->index));
  lines.emplace_back();
  for (const ObjectEntries* object : listed) append_object(lines, *object, devices);
}

}  // namespace

std::string eds_text(const EdsTitle& title, std::span<const EdsDevice> devices) {
  const nodes::ObjectDictionary& dictionary = *devices.front().dictionary;
  const std::vector<ObjectEntries> objects = objects_of(dictionary);
  std::vector<std::string> lines;
  append_head(lines, title, dictionary, objects);
  append_part(lines, Part::kMandatory, "MandatoryObjects", objects, devices);
  append_part(lines, Part::kOptional, "OptionalObjects", objects, devices);
  append_part(lines, Part::kManufacturer, "ManufacturerObjects", objects, devices);
  std::string text;
  for (const std::string& line : lines) text.append(line).append("\r\n");
  return text;
}

}  // namespace walkman::datasheets
