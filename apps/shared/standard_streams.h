#pragma once

namespace walkman::apps {

/// To be called before anything is opened: a closed standard stream would give its number to the next file
/// that is opened, which then gets what was meant for the stream. Puts in its place what refuses every
/// reading and writing. A full file and a reader that has gone become errors of the writing instead of
/// signals.
void secure_standard_streams();

/// `code`, or kEnvironment when not all of the output could be written, which is then said on standard error.
[[nodiscard]] int checked_output(int code);

}  // namespace walkman::apps
