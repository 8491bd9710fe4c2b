// A device's datagrams into the camera's client: correct and incorrect answers, fragments in any order,
// frames, scans and acknowledgements that nobody requested, while it opens, looks and sweeps.

#include <deque>
#include <vector>

#include "drivers/camera/multisense/camera.h"
#include "tests/fuzz/input.h"

namespace walkman::fuzz {
namespace {

using namespace multisense;

/// The device's side: gives the answers that a client cannot do without, unless the input says otherwise, and
/// sends the contents of the input.
class AnsweringPort final : public DatagramPort {
 public:
  explicit AnsweringPort(Input& input) : input_(input) {}

  void send(std::span<const std::uint8_t> datagram) override {
    const auto head = read_head(datagram);
    require(head && head->message_bytes == datagram.size() - kDatagramHeadBytes, "a request is one datagram");
    const auto message = datagram.subspan(kDatagramHeadBytes);
    const unsigned how = input_.byte();
    if ((how & 1U) != 0) from_input(how >> 1U);
    if ((how & 0x80U) != 0) return;  // no answer
    answer(*id_of(message), message);
  }
  [[nodiscard]] bool receive(std::vector<std::uint8_t>& datagram) override {
    if (waiting_.empty()) return false;
    datagram.swap(waiting_.front());
    waiting_.pop_front();
    return true;
  }
  [[nodiscard]] bool wait(Time) override {
    if (waiting_.empty() && !input_.empty()) from_input(input_.byte());
    return !waiting_.empty();
  }
  /// Queues a datagram or a message from the input.
  void from_input(unsigned how) {
    const auto bytes = input_.bytes(input_.byte());
    switch (how & 7U) {
      case 0:
        waiting_.emplace_back(bytes.begin(), bytes.end());
        break;
      case 1:
        push(bytes, (how & 8U) != 0);
        break;
      case 2: {
        Disparity image{7, static_cast<std::uint16_t>(2 * (how >> 4U)), 2, {}};
        image.pixels.resize(std::size_t{image.width} * image.height);
        for (std::size_t i = 0; i < image.pixels.size() && i < bytes.size(); ++i) image.pixels[i] = bytes[i];
        push(encode(image), (how & 8U) != 0);
        break;
      }
      case 3: {
        ImageMetadata metadata;
        metadata.frame = 7;
        metadata.captured = {static_cast<std::uint32_t>(how), 0};
        push(encode(metadata), (how & 8U) != 0);
        break;
      }
      case 4: {
        LidarData scan;
        scan.ranges_mm.resize(bytes.size());
        scan.intensities.resize(bytes.size());
        for (std::size_t i = 0; i < bytes.size(); ++i) scan.ranges_mm[i] = 100U * bytes[i];
        scan.last_microradians = static_cast<std::int32_t>(how << 15U);
        push(encode(scan), (how & 8U) != 0);
        break;
      }
      default: {  // an answer with a body from the input
        static constexpr std::uint16_t kIds[] = {
            Ack::kId,   Status::kId,           DeviceInfo::kId,    CameraCalibration::kId,
            Image::kId, LidarCalibration::kId, ImageMetadata::kId, CameraConfig::kId};
        Writer writer(kIds[how >> 3U & 7U], 2);
        writer.raw(bytes);
        push(writer.take(), false);
      }
    }
  }

 private:
  void push(std::span<const std::uint8_t> message, bool swapped) {
    if (message.size() < kMessageHeadBytes) return;
    Fragments fragments(message, ++sequence_, kLeastMtu);
    while (!fragments.done()) {
      std::vector<std::uint8_t> datagram;
      fragments.next(datagram);
      if (swapped) {
        waiting_.push_front(std::move(datagram));
      } else {
        waiting_.push_back(std::move(datagram));
      }
    }
  }
  void acknowledge(std::uint16_t request) { push(encode(Ack{request, Ack::kOk}), false); }
  void answer(std::uint16_t id, std::span<const std::uint8_t> message) {
    if (const auto test = decode<MtuTest>(message)) {
      MtuAnswer full;
      full.filler.resize(64);
      push(encode(full), false);
    } else if (id == static_cast<std::uint16_t>(Query::kDeviceInfo)) {
      DeviceInfo info;
      info.imager_width = 4;
      info.imager_height = 2;
      info.laser_name = "laser";
      push(encode(info), false);
    } else if (id == static_cast<std::uint16_t>(Query::kCameraCalibration)) {
      CameraCalibration calibration;
      for (CameraCalibration::Camera* camera : {&calibration.left, &calibration.right})
        camera->P = {600, 0, 4, 0, 0, 600, 1, 0, 0, 0, 1, 0};
      calibration.right.P[3] = -42;
      push(encode(calibration), false);
    } else if (id == static_cast<std::uint16_t>(Query::kCameraConfig)) {
      CameraConfig config;  // not in the ratio of the imager
      config.width = 6;
      config.height = 2;
      config.fx = config.fy = 600;
      push(encode(config), false);
    } else if (id == static_cast<std::uint16_t>(Query::kLidarCalibration)) {
      LidarCalibration calibration;
      for (auto* X : {&calibration.X_SpL, &calibration.X_CSp})
        for (const std::size_t i : {0U, 5U, 10U, 15U}) (*X)[i] = 1;
      push(encode(calibration), false);
    } else if (id == static_cast<std::uint16_t>(Query::kStatus)) {
      push(encode(Status{}), false);
    } else {
      acknowledge(id);
    }
  }

  Input& input_;
  std::deque<std::vector<std::uint8_t>> waiting_;
  std::uint16_t sequence_ = 0;
};

void look(Camera& camera, Input& input, Time& now) {
  camera::OrganizedCloud cloud;
  std::vector<Eigen::Vector3f> points;
  for (int looks = 0; looks < 64 && !input.empty(); ++looks) {
    const unsigned how = input.byte();
    now += input.pause();
    camera.set_waiting((how & 8U) != 0 ? Camera::Waiting::kBlock : Camera::Waiting::kPoll);
    switch (how & 7U) {
      case 0:
        camera.also_stream(source::kLumaLeft);
        [[fallthrough]];
      case 1:
        if (!camera.latest(Time::min(), cloud)) break;
        require(cloud.points.size() ==
                    static_cast<std::size_t>(cloud.width) * static_cast<std::size_t>(cloud.height),
                "a cloud has a point for each pixel");
        static_cast<void>(camera.image(source::kLumaLeft));
        break;
      case 2:
        static_cast<void>(camera.begin_sweep(1));
        break;
      case 3:
        if (camera.swept(points)) require(points.size() < 1'000'000, "a sweep is bounded");
        break;
      case 4:
        static_cast<void>(camera.take_scans());
        break;
      default:
        camera.spin(how >> 4U);
    }
  }
}

}  // namespace
}  // namespace walkman::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace walkman;
  fuzz::Input input(data, size);
  fuzz::AnsweringPort port(input);
  Time now = std::chrono::seconds(1);
  try {
    multisense::Camera camera(port, "the camera", [&] { return now; });
    try {
      fuzz::look(camera, input, now);
    } catch (const camera::Lost& lost) {
      fuzz::require(std::string_view(lost.what()).starts_with("the camera: "), "a loss names the camera");
    }
  } catch (const camera::Lost& lost) {
    fuzz::require(std::string_view(lost.what()).starts_with("the camera: "), "a loss names the camera");
  }
  return 0;
}
