#include "tests/unit/drivers/dictionary_node.h"

#include <cstdio>

namespace walkman::test {
namespace {

constexpr unsigned kFdLengths[] = {8, 12, 16, 20, 24, 32, 48, 64};

std::uint64_t number(const std::uint8_t* bytes, unsigned count) {
  std::uint64_t value = 0;
  for (unsigned i = count; i-- > 0;) value = value << 8U | bytes[i];
  return value;
}

/// CRC-8 with polynomial 2Fh, init and final XOR FFh, bit by bit, over COB-ID and `bytes` bytes.
std::uint8_t crc8(const can::Frame& frame, unsigned bytes) {
  unsigned crc = 0xFF;
  const auto add = [&crc](unsigned byte) {
    crc ^= byte & 0xFFU;
    for (int bit = 0; bit < 8; ++bit)
      crc = (crc & 0x80U) != 0 ? (crc << 1 ^ 0x2FU) & 0xFFU : crc << 1 & 0xFFU;
  };
  add(frame.id);
  add(frame.id >> 8U);
  for (unsigned i = 0; i < bytes; ++i) add(frame.data[i]);
  return static_cast<std::uint8_t>(crc ^ 0xFFU);
}

}  // namespace

void DictionaryNode::define(unsigned index, unsigned sub, unsigned bytes, std::uint64_t value) {
  objects_[{index, sub}] = {bytes, value, value};
}

void DictionaryNode::define_common(std::uint32_t device_type) {
  define(0x1000, 0, 4, device_type);
  define(0x1016, 1, 4, 0);
  define(0x1017, 0, 2, 0);
  define(0x1018, 1, 4, 0x4B4C4157);
  define(0x1018, 2, 4, 1);
  define(0x1018, 3, 4, 0x00010000);
  define(0x1018, 4, 4, 1000 + id_);
  define(0x1019, 0, 1, 0);
  define(0x2050, 1, 2, 0);
  define(0x2052, 0, 2, 0);
  define_pdos();
}

void DictionaryNode::define_pdos() {
  for (unsigned n = 0; n < 4; ++n) {
    for (const unsigned base : {0x1400U, 0x1800U}) {
      const unsigned cob_id = (base == 0x1400 ? 0x200U : 0x180U) + 0x100U * n + id_;
      define(base + n, 1, 4, 0x80000000U | cob_id);
      define(base + n, 2, 1, 255);
      define(base + n, 3, 2, 0);
      define(base + n, 5, 2, 0);
      for (unsigned sub = 0; sub <= 16; ++sub) define(base + 0x200 + n, sub, sub == 0 ? 1 : 4, 0);
    }
  }
}

void DictionaryNode::become_drive(std::uint32_t rated_torque_mnm, std::uint32_t spring_mnm) {
  drive_ = true;
  define_common(0x00020192);
  define(0x2011, 1, 2, 0x1234);
  define(0x2011, 2, 2, 0x0567);
  define(0x2020, 2, 4, 0);
  define(0x2020, 3, 4, spring_mnm);
  define(0x2031, 1, 1, 35);
  define(0x6007, 0, 2, 1);
  define(0x603F, 0, 2, 0);
  define(0x6040, 0, 2, 0);
  define(0x6041, 0, 2, 0x0250);
  define(0x6060, 0, 1, 0);
  define(0x6061, 0, 1, 0);
  define(0x6064, 0, 4, 0);
  define(0x606C, 0, 4, 0);
  define(0x6071, 0, 2, 0);
  define(0x6072, 0, 2, 0);
  define(0x6076, 0, 4, rated_torque_mnm);
  define(0x6077, 0, 2, 0);
  define(0x607A, 0, 4, 0);
  define(0x60B2, 0, 2, 0);
  define(0x60C2, 1, 1, 1);
  define(0x60C2, 2, 1, 0xFD);
  define(0x60E4, 1, 4, 0);
  define(0x60FF, 0, 4, 0);
}

void DictionaryNode::become_sensor(int channels) {
  define_common(0x00020194);
  for (unsigned sub = 1; sub <= static_cast<unsigned>(channels); ++sub) {
    define(0x6132, sub, 1, sub <= 3 ? 1 : 2);
    define(0x7130, sub, 2, 0);
  }
  define(0x6150, 1, 1, 0);
}

void DictionaryNode::boot_up() {
  nmt_state_ = 0x7F;
  for (auto& [address, object] : objects_) {
    if (address.first >= 0x1000 && address.first < 0x2000) object.value = object.initial;
  }
  waiting_ = {};
  heartbeat_due_ = Time::max();
  send(can::Frame(0x700 + id_, {0}));
}

void DictionaryNode::power_cycle(Time now) {
  now_ = now;
  if (drive_) {
    set(0x6041, 0, 0x0250);
    set(0x6061, 0, 0);
    set(0x6040, 0, 0);
  }
  boot_up();
}

void DictionaryNode::fault(std::uint16_t code) {
  set(0x6041, 0, 0x0218);
  set(0x603F, 0, code);
  can::Frame emergency(0x080 + id_, {0, 0, 0x21, 0, 0, 0, 0, 0});
  emergency.data[0] = static_cast<std::uint8_t>(code);
  emergency.data[1] = static_cast<std::uint8_t>(code >> 8U);
  send(emergency);
}

void DictionaryNode::nmt(unsigned command) {
  if (command == 0x01) {
    nmt_state_ = 0x05;
    syncs_ = {};
  }
  if (command == 0x02) nmt_state_ = 0x04;
  if (command == 0x80) nmt_state_ = 0x7F;
  if (command == 0x82) ++resets;
  if (command == 0x81 || command == 0x82) boot_up();
}

std::uint32_t DictionaryNode::judge_write(unsigned index, unsigned sub, unsigned bytes,
                                          std::uint64_t value) const {
  const auto found = objects_.find({index, sub});
  if (found == objects_.end()) return 0x06020000;
  if (found->second.bytes != bytes) return 0x06070010;
  const bool receive = (index >= 0x1400 && index < 0x1404) || (index >= 0x1600 && index < 0x1604);
  const bool mapping = (index & 0xFE00U) == 0x1600 || (index & 0xFE00U) == 0x1A00;
  const unsigned communication = mapping ? index - 0x200 : index;
  if (index < 0x1400 || index >= 0x1A04) return 0;
  const bool valid = (this->value(communication, 1) & 0x80000000U) == 0;
  if (!mapping) {
    const bool locked = valid && (sub == 3 || (sub == 1 && (value & 0x80000000U) == 0));
    return locked ? 0x08000022 : 0;
  }
  if (valid || (sub != 0 && this->value(index, 0) != 0)) return 0x08000022;
  if (sub != 0) {
    const auto object =
        objects_.find({static_cast<unsigned>(value >> 16U), static_cast<unsigned>(value >> 8U & 0xFFU)});
    const bool dummy = receive && value >> 16U <= 7;
    if (!dummy && (object == objects_.end() || object->second.bytes * 8 != (value & 0xFFU)))
      return 0x06040041;
    return 0;
  }
  unsigned bits = 0;
  for (unsigned i = 1; i <= value; ++i) bits += this->value(index, i) & 0xFFU;
  return bits > (fd_ ? 512U : 64U) ? 0x06040042 : 0;
}

void DictionaryNode::sdo(const can::Frame& request) {
  if (nmt_state_ == 0x04 || request.length != 8 || request.data[0] == 0x80) return;
  const auto index = static_cast<unsigned>(number(request.data.data() + 1, 2));
  const unsigned sub = request.data[3];
  can::Frame answer = request;
  answer.id = 0x580 + id_;
  const auto abort = [&](std::uint32_t code) {
    answer.data[0] = 0x80;
    for (unsigned i = 0; i < 4; ++i) answer.data[4 + i] = static_cast<std::uint8_t>(code >> 8 * i);
    char text[64];
    std::snprintf(text, sizeof text, "%02X %04X:%u -> %08X", request.data[0], index, sub, code);
    refusals.emplace_back(text);
    send(answer);
  };
  if (request.data[0] == 0x40) {
    const auto found = objects_.find({index, sub});
    if (found == objects_.end()) return abort(0x06020000);
    answer.data[0] = static_cast<std::uint8_t>(0x43U | (4 - found->second.bytes) << 2U);
    const bool lie = wrong_readback && index == 0x1A00 && sub == 1;
    for (unsigned i = 0; i < 4; ++i) {
      answer.data[4 + i] = static_cast<std::uint8_t>((found->second.value ^ (lie ? 0x10000U : 0U)) >> 8 * i);
    }
    return send(answer);
  }
  const unsigned bytes = 4 - (request.data[0] >> 2U & 3U);
  const std::uint64_t value = number(request.data.data() + 4, bytes);
  if ((request.data[0] & 0xE3U) != 0x23) return abort(0x05040001);
  if (const std::uint32_t code = judge_write(index, sub, bytes, value)) return abort(code);
  set(index, sub, value);
  if (index == 0x1017) heartbeat_due_ = value == 0 ? Time::max() : now_;
  if (index == 0x6060) set(0x6061, 0, value);
  answer.data[0] = 0x60;
  for (unsigned i = 4; i < 8; ++i) answer.data[i] = 0;
  send(answer);
}

bool DictionaryNode::protects(unsigned mapping) const {
  const auto last = static_cast<unsigned>(value(mapping, 0));
  return last > 0 && value(mapping, last) == 0x20520010;
}

can::Frame DictionaryNode::tpdo(unsigned n) {
  can::Frame frame;
  frame.id = static_cast<std::uint32_t>(value(0x1800 + n, 1) & 0x7FFU);
  for (unsigned i = 1; i <= value(0x1A00 + n, 0); ++i) {
    const auto entry = static_cast<unsigned>(value(0x1A00 + n, i));
    const std::uint64_t bits = value(entry >> 16U, entry >> 8U & 0xFFU);
    for (unsigned k = 0; k < (entry & 0xFFU) / 8; ++k) {
      frame.data[frame.length++] = static_cast<std::uint8_t>(bits >> 8 * k);
    }
  }
  if (protects(0x1A00 + n)) {
    frame.data[frame.length - 2U] = static_cast<std::uint8_t>(++counts_[n]);
    frame.data[frame.length - 1U] = crc8(frame, frame.length - 1U);
  }
  frame.fd = fd_;
  if (frame.length > 8) {
    for (const unsigned length : kFdLengths) {
      if (length < frame.length) continue;
      frame.length = static_cast<std::uint8_t>(length);
      break;
    }
  }
  return frame;
}

void DictionaryNode::take_rpdo(unsigned n, const can::Frame& frame) {
  unsigned offset = 0;
  for (unsigned i = 1; i <= value(0x1600 + n, 0); ++i) {
    const auto entry = static_cast<unsigned>(value(0x1600 + n, i));
    const unsigned bytes = (entry & 0xFFU) / 8;
    if (entry >> 16U > 7) set(entry >> 16U, entry >> 8U & 0xFFU, number(frame.data.data() + offset, bytes));
    offset += bytes;
  }
  if (offset > frame.length) refusals.emplace_back("RPDO too short");
  if (protects(0x1600 + n)) {
    if (frame.data[offset - 1] != crc8(frame, offset - 1)) refusals.emplace_back("RPDO with a wrong CRC");
    if (const unsigned count = frame.data[offset - 2]; std::exchange(rpdo_counts_[n], count) == count)
      refusals.emplace_back("RPDO with the count of the last");
  }
  run_state_machine();
}

void DictionaryNode::sync() {
  if (nmt_state_ != 0x05) return;
  set(0x2050, 1, (value(0x2050, 1) + 1) & 0xFFFFU);
  for (unsigned n = 0; n < 4; ++n) {
    const auto type = static_cast<unsigned>(value(0x1800 + n, 2));
    if ((value(0x1800 + n, 1) & 0x80000000U) != 0 || type < 1 || type > 240) continue;
    if (++syncs_[n] % type == 0) send(tpdo(n));
  }
  for (unsigned n = 0; n < 4; ++n) {
    if (std::exchange(waiting_[n], false)) take_rpdo(n, rpdos_[n]);
  }
}

void DictionaryNode::run_state_machine() {
  if (!drive_) return;
  const auto word = static_cast<std::uint16_t>(value(0x6040));
  const bool edge = (word & 0x80U) != 0 && (last_controlword_ & 0x80U) == 0;
  last_controlword_ = word;
  auto status = static_cast<unsigned>(value(0x6041));
  if ((status & 0x4FU) == 0x08) {
    if (edge && !fault_persists) {
      status = 0x0250;
      ++fault_resets;
      set(0x603F, 0, 0);
    }
  } else if ((word & 0x02U) == 0) {
    status = 0x0250;  // disable voltage
  } else if ((word & 0x04U) == 0) {
    status = (status & 0x6FU) == 0x27 ? 0x0217 : 0x0250;  // quick stop
  } else if ((word & 0x0FU) == 0x06) {
    status = 0x0231;
  } else if ((word & 0x0FU) == 0x07 && (status & 0x6FU) != 0x40) {
    status = 0x0233;
  } else if ((word & 0x0FU) == 0x0F && ((status & 0x6FU) == 0x23 || (status & 0x6FU) == 0x27)) {
    status = 0x1237;
  }
  set(0x6041, 0, status);
  set(0x6061, 0, value(0x6060));
  if (moves && status == 0x1237) {
    set(0x6064, 0, value(0x607A));
    set(0x606C, 0, value(0x60FF));
  }
}

void DictionaryNode::hear(const can::Frame& sent, Time now) {
  now_ = now;
  if (sent.id == 0x080) return sync();
  if (sent.id == 0x000 && (sent.data[1] == 0 || sent.data[1] == id_)) return nmt(sent.data[0]);
  if (sent.id == 0x600 + id_) return sdo(sent);
  for (unsigned n = 0; n < 4; ++n) {
    if (nmt_state_ != 0x05 || value(0x1400 + n, 1) != sent.id) continue;
    const bool synchronous = value(0x1400 + n, 2) <= 240;
    rpdos_[n] = sent;
    waiting_[n] = synchronous;
    if (!synchronous) take_rpdo(n, sent);
  }
}

void DictionaryNode::tick(Time now) {
  now_ = now;
  for (; heartbeat_due_ <= now; heartbeat_due_ += std::chrono::milliseconds(value(0x1017))) {
    send(can::Frame(0x700 + id_, {static_cast<std::uint8_t>(nmt_state_)}));
  }
  for (unsigned n = 0; n < 4; ++n) {
    if (nmt_state_ != 0x05 || (value(0x1800 + n, 1) & 0x80000000U) != 0 || value(0x1800 + n, 2) < 254)
      continue;
    if (now < event_due_ || value(0x1800 + n, 5) == 0) continue;
    event_due_ = now + std::chrono::milliseconds(value(0x1800 + n, 5));
    send(tpdo(n));
  }
}

std::vector<can::StampedFrame> DictionaryNode::take() {
  std::vector<can::StampedFrame> taken;
  taken.swap(sent_);
  return taken;
}

}  // namespace walkman::test
