#include "emulator/gateways/socketcand_session.h"

namespace walkman::gateways {

namespace {

using Kind = SocketcandCommand::Kind;

/// Kept free of frames, so that a client that is too slow for the bus still gets its replies.
constexpr std::size_t kReplyRoom = 512;
constexpr std::size_t kLongestReply = 64;

/// Number of characters that python-can reads at a time.
constexpr std::size_t kClientRead = 1024;

}  // namespace

SocketcandSession::SocketcandSession(ControllerPool& pool, SocketcandCounters& counters, Time wall)
    : pool_(pool), counters_(counters), open_until_(wall + kOpenLimit) {
  reply("< hi >");
}

SocketcandSession::~SocketcandSession() {
  if (attached_.controller != nullptr) pool_.give_back(attached_.controller);
}

SocketcandSession::Step SocketcandSession::step(std::string_view& input, Time wall) {
  if (waiting_) return offer() ? Step::kDone : Step::kBlocked;
  if (outgoing_.room() < kLongestReply) return Step::kBlocked;
  switch (reader_.read(input)) {
    case SocketcandReader::Result::kNeedMore:
      return Step::kNeedMore;
    case SocketcandReader::Result::kMessage:
      steps_held_ = 0;
      return handle(parse_socketcand(reader_.message()), wall);
    case SocketcandReader::Result::kGarbage:
      break;
  }
  ++counters_.errors;
  return Step::kClosed;
}

SocketcandSession::Step SocketcandSession::handle(const SocketcandCommand& command, Time wall) {
  if (mode_ == Mode::kNoBus) return begin(command);
  bool known = false;
  switch (command.kind) {
    case Kind::kEcho:
      reply("< echo >");
      return Step::kDone;
    case Kind::kMalformed:
      refuse("< error syntax error >");
      return Step::kDone;
    case Kind::kRawMode:
      known = enter(Mode::kRaw, wall);
      break;
    case Kind::kBcmMode:
      known = enter(Mode::kBcm, wall);
      break;
    case Kind::kControlMode:
      known = enter(Mode::kControl, wall);
      break;
    case Kind::kSend:
      known = mode_ != Mode::kControl && send(command.frame);
      break;
    case Kind::kSendFd:
      known = mode_ == Mode::kRaw && send(command.frame);
      break;
    case Kind::kStatistics:
      known = mode_ == Mode::kControl;
      if (known) {
        statistics_interval_ = command.interval;
        statistics_at_ = attached_.bus->now() + command.interval;
      }
      break;
    default:
      known = mode_ == Mode::kBcm && manage(command);
  }
  if (!known) refuse("< error unknown command >");
  return Step::kDone;
}

SocketcandSession::Step SocketcandSession::begin(const SocketcandCommand& command) {
  if (command.kind != Kind::kOpen) {
    refuse("< error unknown command >");
    return Step::kClosed;
  }
  attached_ = pool_.take(command.bus);
  if (attached_.controller == nullptr) {
    refuse("< error could not open bus >");
    return Step::kClosed;
  }
  overflows_ = attached_.controller->receive_overflows();
  open_until_ = Time::max();
  mode_ = Mode::kBcm;
  reply("< ok >");
  return Step::kDone;
}

bool SocketcandSession::enter(Mode mode, Time wall) {
  if (mode == mode_) return false;
  forward(wall);  // frames that came before belong to the previous mode
  mode_ = mode;
  manager_.clear();
  if (mode == Mode::kRaw) {
    steps_held_ = kHandshakeSteps;
    held_until_ = wall + kHandshakeStep;
  }
  statistics_at_ = attached_.bus->now() + statistics_interval_;
  reply("< ok >");
  return true;
}

bool SocketcandSession::manage(const SocketcandCommand& command) {
  bool room = true;
  switch (command.kind) {
    case Kind::kAdd:
      room = manager_.add(command.frame, command.interval, attached_.bus->now());
      send_due();
      break;
    case Kind::kUpdate:
      manager_.update(command.frame);
      break;
    case Kind::kDelete:
      manager_.remove(command.frame);
      break;
    case Kind::kSubscribe:
      room = manager_.subscribe(command.frame, command.interval);
      break;
    case Kind::kFilter:
      room = manager_.filter(command.frame, command.interval, command.masks.front());
      break;
    case Kind::kMuxFilter:
      room = manager_.filter_multiplexed(command.frame, command.interval, command.masks);
      break;
    case Kind::kUnsubscribe:
      manager_.unsubscribe(command.frame);
      break;
    default:
      return false;
  }
  if (!room) refuse("< error too many jobs >");
  return true;
}

bool SocketcandSession::send(const can::Frame& frame) noexcept {
  waiting_ = frame;
  static_cast<void>(offer());
  return true;
}

bool SocketcandSession::offer() noexcept {
  const can::SendResult result = attached_.controller->send(*waiting_);
  if (result == can::SendResult::kQueueFull) return false;
  if (result == can::SendResult::kQueued) {
    ++counters_.sent;
    transmitted_.count(*waiting_);
  } else {
    ++counters_.refused;
    if (result == can::SendResult::kInvalid) refuse("< error no such frame on this bus >");
  }
  waiting_.reset();
  return true;
}

void SocketcandSession::send_due() noexcept {
  while (const can::Frame* const frame = manager_.due(attached_.bus->now())) {
    if (attached_.controller->send(*frame) == can::SendResult::kQueued) {
      ++counters_.sent;
      transmitted_.count(*frame);
    } else {
      ++counters_.refused;
    }
  }
}

bool SocketcandSession::held(Time wall) noexcept {
  if (steps_held_ > 0 && wall >= held_until_) {
    --steps_held_;
    held_until_ = wall + kHandshakeStep;
  }
  if (steps_held_ == 0) held_until_ = Time::min();
  return steps_held_ > 0;
}

void SocketcandSession::forward(Time wall) noexcept {
  if (attached_.controller == nullptr || held(wall)) return;
  send_due();
  can::StampedFrame frame;
  while (attached_.controller->receive(frame)) {
    if (!frame.frame.error) received_.count(frame.frame);
    if (mode_ == Mode::kRaw || (mode_ == Mode::kBcm && manager_.wants(frame))) write(frame);
  }
  while (manager_.take_held(attached_.bus->now(), frame)) write(frame);
  if (mode_ == Mode::kControl) forward_statistics();
  // In other modes the controller's queue may overflow: nobody wants those frames.
  if (mode_ == Mode::kRaw) counters_.dropped += attached_.controller->receive_overflows() - overflows_;
  overflows_ = attached_.controller->receive_overflows();
}

void SocketcandSession::forward_statistics() noexcept {
  const Time now = attached_.bus->now();
  if (statistics_interval_ == Time{} || now < statistics_at_) return;
  statistics_at_ += statistics_interval_ * ((now - statistics_at_) / statistics_interval_ + 1);
  TextLine line;
  line.add("< stat ");
  for (const std::uint64_t value :
       {received_.bytes, received_.packets, transmitted_.bytes, transmitted_.packets}) {
    line.add_decimal(value);
    line.add(' ');
  }
  line.add('>');
  if (outgoing_.room() >= line.text().size() + kReplyRoom) reply(line.text());
}

void SocketcandSession::write(const can::StampedFrame& frame) noexcept {
  TextLine line;
  line.add('\n');
  const SocketcandData data = mode_ == Mode::kRaw ? SocketcandData::kTogether : SocketcandData::kApart;
  if (!write_socketcand(frame, data, line)) {
    ++counters_.skipped;
    return;
  }
  std::string_view message = line.text();
  if (written_ + message.size() <= kClientRead) message.remove_prefix(1);
  if (outgoing_.room() < message.size() + kReplyRoom || !outgoing_.push(message)) {
    ++counters_.dropped;
    return;
  }
  written_ += message.size();
  ++counters_.received;
}

}  // namespace walkman::gateways
