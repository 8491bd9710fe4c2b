#include "drivers/cia404/measuring_device.h"

#include "drivers/canopen/objects.h"

namespace walkman::cia404 {

namespace cause = canopen::cause;

MeasuringDevice::MeasuringDevice(const canopen::NodeSettings& settings, std::size_t channels)
    : RemoteNode(settings), count_(channels), channels_(settings.pdos, channels, settings.cycle) {}

void MeasuringDevice::set_measuring_steps(const std::vector<canopen::SdoStep>& extra) {
  std::vector<canopen::SdoStep> steps =
      canopen::identity_steps(settings(), kAnalogueInputType, vendor_place());
  canopen::append(steps, canopen::supervision_steps(settings()));
  canopen::append(steps, extra);
  canopen::append(steps, canopen::pdo_steps(settings().pdos, node_id()));
  set_configuration(std::move(steps));
}

canopen::DevicePdos MeasuringDevice::vector_pdos() {
  namespace object = canopen::object;
  canopen::DevicePdos pdos = canopen::predefined_pdos();
  constexpr std::uint16_t kValue = object::kProcessValueInt16;
  enable(pdos.transmit[0], 1,
         {{kValue, 1, 16}, {kValue, 2, 16}, {kValue, 3, 16}, {object::kCycleCounter, 1, 16}});
  enable(pdos.transmit[1], 1,
         {{kValue, 4, 16}, {kValue, 5, 16}, {kValue, 6, 16}, {object::kMeasuringStatus, 1, 8}});
  return pdos;
}

void MeasuringDevice::on_begin_boot() noexcept {
  channels_.reset();
  for (RepeatWatch& vector : vectors_) vector.restart();
  out_of_range_ = false;
  reset_sample();
}

void MeasuringDevice::on_tpdo(int number, const can::StampedFrame& stamped) noexcept {
  if (!channels_.take(number, stamped)) return;
  out_of_range_ = !decode(channels_);
  for (std::size_t i = 0; i < count_; ++i) out_of_range_ = out_of_range_ || channels_.out_of_range(i);
  for (std::size_t i = 0; i < vectors_.size(); ++i)
    vectors_[i].take({channels_.raw(3 * i), channels_.raw(3 * i + 1), channels_.raw(3 * i + 2)});
  MeasuringSample& sample = newest();
  sample.sample_counter = channels_.counter();
  sample.status = channels_.status();
  sample.out_of_range = out_of_range_;
}

void MeasuringDevice::poll(Time now) noexcept {
  RemoteNode::poll(now);
  newest().age = canopen::age_of(channels_.at(), now);
}

void MeasuringDevice::clear_events() noexcept {
  RemoteNode::clear_events();
  for (RepeatWatch& vector : vectors_) vector.restart();
}

std::optional<canopen::FaultCause> MeasuringDevice::judge_values(Time now) const noexcept {
  const Time age = canopen::age_of(channels_.at(), now);
  if (age > settings().cycle * settings().stale_after_cycles * sync_divider()) {
    return cause::CounterStuck{channels_.counter(), age};
  }
  if (channels_.status() != 0) return cause::MeasuringStatus{channels_.status()};
  if (out_of_range_) return cause::OutOfRange{};
  for (std::size_t i = 0; i < vectors_.size(); ++i)
    if (const int samples = vectors_[i].frozen(); samples > 0)
      return cause::ReadingsFrozen{static_cast<int>(3 * i) + 1, samples};
  return std::nullopt;
}

std::string MeasuringDevice::what_samples_miss() const {
  return in_operation() ? std::string() : "no complete sample";
}

std::string_view MeasuringDevice::error_text(std::uint16_t code) const noexcept {
  if (vendor() == canopen::kRobotVendor) {
    if (code == 0xFF01) return "a channel is over its range";
    if (code == 0xFF02) return "a channel has no reading";
  }
  return canopen::communication_error_text(code);
}

}  // namespace walkman::cia404
