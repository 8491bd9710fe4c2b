#pragma once

#include "emulator/bus/error_report.h"
#include "emulator/bus/frame_length.h"
#include "emulator/bus/participant.h"

namespace walkman::bus {

/// One attempt to send a frame, planned when it starts.
struct Attempt {
  WireLength frame;                            ///< until receivers have it, or until the error flag
  WireLength interframe;                       ///< from there until the next arbitration
  WireLength flag;                             ///< of the interframe, superposed error flags
  bool failed = false;                         ///< ends in an error frame
  bool destroyed = false;                      ///< and the receivers do not have it
  bool mixed = false;                          ///< has several senders, or a receiver that misses it
  bool lost = false;                           ///< nobody receives it, by a verdict
  bool timeless = false;                       ///< takes no time
  const Participant* first_to_flag = nullptr;  ///< the receiver that saw the error before all others
  BusError error;                              ///< as the sender sees it
};

}  // namespace walkman::bus
