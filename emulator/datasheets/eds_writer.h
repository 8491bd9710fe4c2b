#pragma once

#include <span>
#include <string>

#include "emulator/datasheets/eds_object.h"

namespace walkman::datasheets {

/// Title data of an EDS.
struct EdsTitle {
  std::string file_name;    ///< "joint_drive.eds"
  std::string product;      ///< ProductName
  std::string order_code;   ///< OrderCode
  std::string description;  ///< one line
};

/// The electronic data sheet (CiA 306) of a device type: every object in the dictionary of `devices`, of
/// which there is at least one, all of that type. Lines end with CR LF; the same devices give the same text.
/// Throws std::runtime_error if the dictionaries differ in more than values.
[[nodiscard]] std::string eds_text(const EdsTitle& title, std::span<const EdsDevice> devices);

}  // namespace walkman::datasheets
