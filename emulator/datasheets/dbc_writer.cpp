#include "emulator/datasheets/dbc_writer.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>

#include <fmt/format.h>

#include "emulator/datasheets/dbc_model.h"

namespace walkman::datasheets {
namespace {

/// 15 digits in plain decimal notation: some readers accept no exponent.
std::string decimal(double value) {
  if (value == 0) return "0";
  const int decimals = std::clamp(14 - static_cast<int>(std::floor(std::log10(std::abs(value)))), 0, 30);
  std::string text = fmt::format("{:.{}f}", value, decimals);
  if (text.find('.') == std::string::npos) return text;
  text.erase(text.find_last_not_of('0') + 1);
  if (text.back() == '.') text.pop_back();
  return text;
}

/// The raw range in the signal's unit, so that readers that clamp never change a value.
std::pair<double, double> range(const DbcSignal& signal) {
  if (signal.is_float) return {0, 0};
  const double span = std::ldexp(1.0, signal.length);
  if (signal.is_signed) return {-span / 2 * signal.factor, (span / 2 - 1) * signal.factor};
  return {0, (span - 1) * signal.factor};
}

std::string list(const std::vector<std::string>& names) {
  if (names.empty()) return "Vector__XXX";
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ",") + name;
  return text;
}

std::string message_text(const DbcMessage& message) {
  std::string text =
      fmt::format("BO_ {} {}: {} {}\n", message.id, message.name, message.length, message.sender);
  for (const DbcSignal& signal : message.signals) {
    const auto [lowest, highest] = range(signal);
    text += fmt::format(" SG_ {} : {}|{}@1{} ({},0) [{}|{}] \"{}\" {}\n", signal.name, signal.start,
                        signal.length, signal.is_signed ? '-' : '+', decimal(signal.factor), decimal(lowest),
                        decimal(highest), signal.unit, list(message.receivers));
  }
  return text + '\n';
}

std::string quoted(const std::string& text) {
  std::string out;
  for (const char c : text) out.push_back(c == '"' || c == '\\' ? '\'' : c);
  return '"' + out + '"';
}

using SignalText = std::function<std::string(const DbcMessage&, const DbcSignal&)>;

std::string each_signal(const std::vector<DbcMessage>& messages, const SignalText& text) {
  std::string all;
  for (const DbcMessage& message : messages)
    for (const DbcSignal& signal : message.signals) all += text(message, signal);
  return all;
}

std::string comments(const std::string& bus, const std::vector<DbcDevice>& devices,
                     const std::vector<DbcMessage>& messages) {
  std::string text =
      fmt::format("CM_ {};\n", quoted("CANopen devices of the bus " + bus + ", values in SI units"));
  text += fmt::format("CM_ BU_ {} \"The robot's computer: NMT master, SYNC producer\";\n", kComputer);
  for (const DbcDevice& device : devices)
    text += fmt::format("CM_ BU_ {} {};\n", identifier(device.name), quoted(device.description));
  for (const DbcMessage& message : messages)
    if (!message.comment.empty())
      text += fmt::format("CM_ BO_ {} {};\n", message.id, quoted(message.comment));
  return text + each_signal(messages, [](const DbcMessage& message, const DbcSignal& signal) {
           if (signal.comment.empty()) return std::string();
           return fmt::format("CM_ SG_ {} {} {};\n", message.id, signal.name, quoted(signal.comment));
         });
}

constexpr int kClassicalBytes = 8;

/// Marks CAN FD frames as the makers of the format do: value 14 of an attribute that is present only if
/// needed.
std::string fd_attributes(const std::vector<DbcMessage>& messages) {
  std::string text;
  for (const DbcMessage& message : messages)
    if (message.length > kClassicalBytes)
      text += fmt::format("BA_ \"VFrameFormat\" BO_ {} 14;\n", message.id);
  if (text.empty()) return text;
  std::string names = "\"StandardCAN\",\"ExtendedCAN\"";
  for (int i = 0; i < 12; ++i) names += ",\"reserved\"";
  names += ",\"StandardCAN_FD\",\"ExtendedCAN_FD\"";
  return fmt::format("BA_DEF_ BO_ \"VFrameFormat\" ENUM {};\n", names) +
         "BA_DEF_DEF_ \"VFrameFormat\" \"StandardCAN\";\nBA_ \"BusType\" \"CAN FD\";\n" + text;
}

std::string attributes(const std::vector<DbcMessage>& messages) {
  std::string text =
      "BA_DEF_ \"BusType\" STRING ;\n"
      "BA_DEF_ SG_ \"ObjectIndex\" INT 0 65535;\n"
      "BA_DEF_ SG_ \"ObjectSub\" INT 0 255;\n"
      "BA_DEF_DEF_ \"BusType\" \"CAN\";\n"
      "BA_DEF_DEF_ \"ObjectIndex\" 0;\n"
      "BA_DEF_DEF_ \"ObjectSub\" 0;\n" +
      fd_attributes(messages);
  return text + each_signal(messages, [](const DbcMessage& message, const DbcSignal& signal) {
           if (signal.object.index == 0) return std::string();
           return fmt::format("BA_ \"ObjectIndex\" SG_ {0} {1} {2};\nBA_ \"ObjectSub\" SG_ {0} {1} {3};\n",
                              message.id, signal.name, signal.object.index, signal.object.sub);
         });
}

std::string value_names(const std::vector<DbcMessage>& messages) {
  return each_signal(messages, [](const DbcMessage& message, const DbcSignal& signal) {
    if (signal.values.empty()) return std::string();
    std::string text = fmt::format("VAL_ {} {}", message.id, signal.name);
    for (const auto& [value, name] : signal.values) text += fmt::format(" {} {}", value, quoted(name));
    return text + " ;\n";
  });
}

std::string float_types(const std::vector<DbcMessage>& messages) {
  return each_signal(messages, [](const DbcMessage& message, const DbcSignal& signal) {
    if (!signal.is_float) return std::string();
    return fmt::format("SIG_VALTYPE_ {} {} : 1;\n", message.id, signal.name);
  });
}

}  // namespace

std::string dbc_text(const std::string& bus, const std::vector<DbcDevice>& devices) {
  std::vector<std::string> names;
  for (const DbcDevice& device : devices) names.push_back(identifier(device.name));
  std::vector<DbcMessage> messages = bus_services(names);
  for (std::size_t i = 0; i < devices.size(); ++i) {
    for (DbcMessage& message : pdo_messages(names[i], *devices[i].dictionary))
      messages.push_back(std::move(message));
    for (DbcMessage& message : device_services(names[i], devices[i].node_id))
      messages.push_back(std::move(message));
  }

  std::string text = "VERSION \"\"\n\nNS_ :\n\nBS_:\n\n";
  text += fmt::format("BU_: {}", kComputer);
  for (const std::string& name : names) text += ' ' + name;
  text += "\n\n";
  for (const DbcMessage& message : messages) text += message_text(message);
  text += comments(bus, devices, messages) + '\n';
  text += attributes(messages) + '\n';
  text += value_names(messages);
  return text + float_types(messages);
}

}  // namespace walkman::datasheets
