#pragma once

#include <string>
#include <vector>

#include "emulator/datasheets/device_files.h"

namespace walkman::datasheets {

/// Returns a Markdown document with its generated tables updated from the devices: the text between a line
/// `<!-- generated: NAME -->` and the next line `<!-- end -->` is replaced. NAME is `objects of every node`,
/// `objects of a drive`, `objects of a measuring device`, or `PDOs of KIND` with a device kind of `buses`.
/// Throws std::runtime_error for any other name, and for a table without its end.
[[nodiscard]] std::string with_object_tables(const std::string& document, const std::vector<WiredBus>& buses);

/// The same for a file, which is rewritten. Throws as above, and if the file cannot be read or written.
[[nodiscard]] std::vector<std::filesystem::path> update_object_tables(const std::vector<WiredBus>& buses,
                                                                      const std::filesystem::path& file);

}  // namespace walkman::datasheets
