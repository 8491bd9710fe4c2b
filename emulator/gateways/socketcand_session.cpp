#include "emulator/gateways/socketcand_session.h"

namespace walkman::gateways {

namespace {

/// Kept free of frames, so that a client that is too slow for the bus still gets its replies.
constexpr std::size_t kReplyRoom = 512;
constexpr std::size_t kLongestReply = 64;

/// What python-can reads at a time.
constexpr std::size_t kClientRead = 1024;

}  // namespace

SocketcandSession::SocketcandSession(EndPool& pool, SocketcandCounters& counters)
    : pool_(pool), counters_(counters) {
  reply("< hi >");
}

SocketcandSession::~SocketcandSession() {
  if (end_ != nullptr) pool_.give_back(end_);
}

SocketcandSession::Step SocketcandSession::step(std::string_view& input, Time wall) noexcept {
  if (waiting_) return offer() ? Step::kDone : Step::kBlocked;
  if (outgoing_.room() < kLongestReply) return Step::kBlocked;
  switch (reader_.read(input)) {
    case SocketcandReader::Result::kNeedMore:
      return Step::kNeedMore;
    case SocketcandReader::Result::kMessage:
      steps_held_ = 0;
      handle(parse_socketcand(reader_.message()), wall);
      return Step::kDone;
    case SocketcandReader::Result::kGarbage:
      refuse("< error syntax error >");
      return Step::kDone;
    case SocketcandReader::Result::kTooLong:
      break;
  }
  refuse("< error message too long >");
  return Step::kClosed;
}

void SocketcandSession::handle(const SocketcandCommand& command, Time wall) noexcept {
  using Kind = SocketcandCommand::Kind;
  switch (command.kind) {
    case Kind::kOpen:
      open(command.bus);
      return;
    case Kind::kEcho:
      reply("< echo >");
      return;
    case Kind::kMalformed:
      refuse("< error syntax error >");
      return;
    case Kind::kUnknown:
      refuse("< error unknown command >");
      return;
    case Kind::kRawMode:
    case Kind::kSend:
      break;
  }
  if (end_ == nullptr) {
    refuse("< error no bus open >");
  } else if (command.kind == Kind::kSend) {
    waiting_ = command.frame;
    static_cast<void>(offer());
  } else {
    if (!raw_) {
      steps_held_ = kHandshakeSteps;
      held_until_ = wall + kHandshakeStep;
    }
    raw_ = true;
    reply("< ok >");
  }
}

void SocketcandSession::open(std::string_view bus) noexcept {
  if (end_ != nullptr) {
    refuse("< error bus already open >");
    return;
  }
  end_ = pool_.take(bus);
  if (end_ == nullptr) {
    refuse("< error could not open bus >");
    return;
  }
  overflows_ = end_->receive_overflows();
  reply("< ok >");
}

bool SocketcandSession::offer() noexcept {
  const can::SendResult result = end_->send(*waiting_);
  if (result == can::SendResult::kQueueFull) return false;
  ++(result == can::SendResult::kQueued ? counters_.sent : counters_.refused);
  waiting_.reset();
  return true;
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
  if (end_ == nullptr || held(wall)) return;
  can::StampedFrame frame;
  while (end_->receive(frame)) {
    if (raw_) write(frame);
  }
  // Before rawmode the end may overflow: nobody wants those frames.
  if (raw_) counters_.dropped += end_->receive_overflows() - overflows_;
  overflows_ = end_->receive_overflows();
}

void SocketcandSession::write(const can::StampedFrame& frame) noexcept {
  TextLine line;
  line.add('\n');
  if (!write_socketcand(frame, line)) {
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
