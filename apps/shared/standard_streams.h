#pragma once

#include <string_view>

namespace walkman::apps {

/// To be called before anything is opened: otherwise the next file opened would get the number of a closed
/// standard stream, and then the data meant for the stream. Replaces closed streams by descriptors that
/// refuse every read and write. A full file and a reader that has gone become write errors instead of
/// signals.
void secure_standard_streams();

/// Writes text to standard output, with everything that a terminal would act on made visible (`printable`).
/// Apart from this, only the functions below and `ProgressLine` write to a standard stream.
void print(std::string_view text);

/// The same for a JSON document, which stays valid: what a terminal would act on is escaped as \uNNNN.
void print_json(std::string_view document);

/// Writes text to standard error in the same way.
void print_to_stderr(std::string_view text);

/// Writes one sentence to standard error, after the program's name.
void say(std::string_view sentence);

/// Returns `code`, or kEnvironment if the output could not be written completely, which is then reported on
/// standard error.
[[nodiscard]] int checked_output(int code);

}  // namespace walkman::apps
