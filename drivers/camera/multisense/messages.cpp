#include "drivers/camera/multisense/messages.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace walkman::multisense {

Time time_of(const SensorTime& t) {
  return std::chrono::seconds(t.seconds) + std::chrono::microseconds(t.microseconds);
}

SensorTime sensor_time(Time t) {
  const auto us = std::chrono::duration_cast<std::chrono::microseconds>(t).count();
  return {static_cast<std::uint32_t>(us / 1000000), static_cast<std::uint32_t>(us % 1000000)};
}

std::int32_t microradians(double angle) {
  return static_cast<std::int32_t>(std::lround(1e6 * std::remainder(angle, 2 * std::numbers::pi)));
}

std::vector<std::uint8_t> encode(Query query) { return Writer(static_cast<std::uint16_t>(query), 1).take(); }

void quantize(std::span<const float> disparities, std::vector<std::uint16_t>& pixels) {
  pixels.resize(disparities.size());
  std::transform(disparities.begin(), disparities.end(), pixels.begin(), [](float d) {
    const float steps = d / Disparity::kStep + 0.5F;
    return static_cast<std::uint16_t>(std::min<float>(steps, Disparity::kLargest));
  });
}

std::vector<std::uint8_t> encode(const Disparity& image) {
  const std::size_t pairs = image.pixels.size() / 2;
  Writer writer(Disparity::kId, Disparity::kVersion, Disparity::kHeadBytes + 3 * pairs);
  writer(image.frame, image.width, image.height);
  std::vector<std::uint8_t> bytes = writer.take();
  bytes.resize(Disparity::kHeadBytes + 3 * pairs);
  std::uint8_t* out = bytes.data() + Disparity::kHeadBytes;
  for (std::size_t i = 0; i < 2 * pairs; i += 2) {
    const unsigned p = image.pixels[i], q = image.pixels[i + 1];
    *out++ = static_cast<std::uint8_t>(p & 0xFFU);
    *out++ = static_cast<std::uint8_t>((p >> 8U & 0xFU) | (q & 0xFU) << 4U);
    *out++ = static_cast<std::uint8_t>(q >> 4U & 0xFFU);
  }
  return bytes;
}

bool decode(std::span<const std::uint8_t> message, Disparity& image) {
  Reader reader(message);
  reader(image.frame, image.width, image.height);
  if (!reader.whole() || reader.id() != Disparity::kId) return false;
  const std::size_t pixels = std::size_t{image.width} * image.height;
  if (pixels % 2 != 0 || message.size() != Disparity::kHeadBytes + pixels / 2 * 3) return false;
  image.pixels.resize(pixels);
  const std::uint8_t* in = message.data() + Disparity::kHeadBytes;
  for (std::size_t i = 0; i < pixels; i += 2, in += 3) {
    image.pixels[i] = static_cast<std::uint16_t>(in[0] | (in[1] & 0xFU) << 8U);
    image.pixels[i + 1] = static_cast<std::uint16_t>(in[1] >> 4U | in[2] << 4U);
  }
  return true;
}

}  // namespace walkman::multisense
