#pragma once

#include <string_view>

namespace walkman::apps {

/// To be called before anything is opened: a closed standard stream would give its number to the next file
/// that is opened, which then gets what was meant for the stream. Puts in its place what refuses every
/// reading and writing. A full file and a reader that has gone become errors of the writing instead of
/// signals.
void secure_standard_streams();

/// Writes text to standard output, all that a terminal would act on made visible (`printable`). Nothing else
/// but the functions below and `ProgressLine` writes to a standard stream.
void print(std::string_view text);

/// The same with a JSON document, which stays one: what a terminal would act on is escaped as \uNNNN.
void print_json(std::string_view document);

/// Writes text to standard error, likewise.
void print_to_stderr(std::string_view text);

/// Writes one sentence to standard error, behind the program's name.
void say(std::string_view sentence);

/// `code`, or kEnvironment when not all of the output could be written, which is then said on standard error.
[[nodiscard]] int checked_output(int code);

}  // namespace walkman::apps
