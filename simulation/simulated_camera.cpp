// SPDX-License-Identifier: Apache-2.0
#include "simulation/simulated_camera.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "acquisition/camera/pacer.h"
#include "core/error.h"
#include "core/parallel.h"
#include "demosaic/sensor/pixel_format.h"

namespace polarscan {
namespace {

using nlohmann::json;

constexpr double kNever_s = 1e9;

// What the pixels of one place see without noise, in counts; rounded, which adds less than a tenth of a
// count.
using Exposure = Image<std::uint16_t>;

std::vector<Exposure> Expose(const SimulatorOptions& options, const SimulatedSensor& sensor,
                             Progress& progress) {
  const SimulatedShoot shoot = PrepareShoot(MakeScene(options.scene, progress), options, progress);
  FrameSettings settings{sensor, options.samples, shoot.gain, options.seed, 0};
  settings.sensor.noise = false;
  std::vector<Exposure> exposures;
  progress.Begin(fmt::format("the simulated camera gets {} pictures ready", shoot.views.size()),
                 shoot.views.size() * std::size_t(shoot.camera.height), "row");
  for (const SimulatedPose& view : shoot.views)
    exposures.push_back(TakePicture(shoot, view, settings, progress));
  return exposures;
}

// Normal numbers, drawn once: a frame takes them from places of its own.
std::vector<float> NormalNumbers(std::uint64_t seed) {
  constexpr std::size_t kCount = 1 << 16;
  std::vector<float> numbers(kCount);
  Random random(seed, 5);
  for (float& number : numbers) number = float(random.Normal());
  return numbers;
}

// Standard deviation of a count whose mean is the index; the last one is the full well's, which has none.
std::vector<float> NoiseOfCounts(const SimulatedSensor& sensor) {
  const double full = sensor.black_dn() + sensor.dn_per_e() * sensor.full_well_e;
  std::vector<float> sigma(std::size_t(std::clamp(std::round(full), 1.0, double(sensor.max_dn()))) + 1, 0.0f);
  for (std::size_t dn = 0; sensor.noise && dn + 1 < sigma.size(); ++dn) {
    const double electrons = std::max(0.0, (double(dn) - sensor.black_dn()) / sensor.dn_per_e());
    const double variance = electrons + sensor.read_noise_e * sensor.read_noise_e;
    sigma[dn] = float(sensor.dn_per_e() * std::sqrt(variance));
  }
  return sigma;
}

class SimulatedCamera : public Camera {
 public:
  explicit SimulatedCamera(const SimulatedCameraOptions& options) : options_(options) {}

  CameraInfo info() const override {
    return {"simulated", "polarscan", "simulated polarization camera", "0"};
  }

  json sensor() const override {
    const SimulatedSensor sensor = Sensor();
    return {{"layout", ToString(sensor.layout)},  {"bits", sensor.bits},
            {"black_dn", sensor.black_dn()},      {"max_dn", sensor.max_dn()},
            {"full_well_e", sensor.full_well_e},  {"dn_per_e", sensor.dn_per_e()},
            {"read_noise_e", sensor.read_noise_e}};
  }

  json features() const override {
    SimulatedCameraOptions copy = options_;
    json values = ToJson(Table(copy));
    values["seed"] = options_.simulator.seed;
    return values;
  }

  void Set(const std::string& feature, const std::string& value) override {
    OptionTable table = Table(options_);
    const json parsed = json::parse(value, nullptr, false);  // numbers and true or false; else a text
    const bool text = std::ranges::any_of(table, [&](const Option& o) {
      return o.name == feature && std::holds_alternative<std::string*>(o.value);
    });
    FromJson({{feature, text || parsed.is_discarded() ? json(value) : parsed}}, table);
  }

  void UseSoftwareTrigger() override { triggered_ = true; }
  void Trigger() override { ++asked_; }

  void Start(Progress& progress) override {
    format_ = ParsePixelFormat(options_.pixel_format);
    SimulatorOptions scene = options_.simulator;
    scene.scene.seed = scene.seed;
    // What takes long is not done again for the same settings.
    json frames = features();
    for (const char* later : {"fps", "frame-loss"}) frames.erase(later);
    json pictures = frames;
    for (const char* of_frames : {"pixel-format", "hold", "prepared"}) pictures.erase(of_frames);
    pictures["bits"] = format_.bits;
    if (std::exchange(pictures_, pictures) != pictures) exposures_ = Expose(scene, Sensor(), progress);
    normal_ = NormalNumbers(scene.seed);
    sigma_ = NoiseOfCounts(Sensor());
    if (std::exchange(frames_, frames) != frames) Prepare();
    next_ = 0;
    pacer_.Start();
  }

  Delivery Next(Frame& frame, std::chrono::milliseconds timeout) override {
    if (!pacer_.WaitUntil(triggered_ && asked_ == 0 ? kNever_s : double(next_) / options_.fps, timeout))
      return Delivery::kNothing;
    asked_ = std::max(0, asked_ - 1);
    Random luck(options_.simulator.seed, 6, next_);
    if (luck.Uniform() < options_.frame_loss) {
      ++next_;
      return Delivery::kNothing;
    }
    if (prepared_.empty()) {
      frame.payload = Pack(format_, WithNoise(exposures_[PlaceOf(next_)], next_));
    } else {
      frame.payload = prepared_[next_ % prepared_.size()];
    }
    frame.info = Describe();
    ++next_;
    return Delivery::kFrame;
  }

  void Stop() override {}

 private:
  SimulatedSensor Sensor() const {
    SimulatedSensor sensor = options_.simulator.sensor;
    sensor.layout = ParseLayout(options_.simulator.layout);
    sensor.bits = ParsePixelFormat(options_.pixel_format).bits;
    return sensor;
  }

  std::size_t PlaceOf(std::uint64_t frame) const {
    return frame / std::uint64_t(options_.hold) % exposures_.size();
  }

  // The first frames, up to the end of a round.
  void Prepare() {
    prepared_.clear();
    const std::size_t round = exposures_.size() * std::size_t(options_.hold);
    for (std::uint64_t frame = 0; frame < round * std::uint64_t(options_.prepared); ++frame)
      prepared_.push_back(Pack(format_, WithNoise(exposures_[PlaceOf(frame)], frame)));
  }

  FrameInfo Describe() const {
    FrameInfo info;
    info.sequence = next_;
    info.camera_time_ns = std::int64_t(double(next_) / options_.fps * 1e9);
    info.host_time_ns = HostTimeNs();
    info.pixel_format = format_.name;
    info.width = options_.simulator.width, info.height = options_.simulator.height;
    return info;
  }

  Image<std::uint16_t> WithNoise(const Exposure& mean, std::uint64_t frame) const {
    Image<std::uint16_t> noisy(mean.width(), mean.height());
    const float highest = float(sigma_.size() - 1);
    ParallelFor(0, mean.height(), [&](int y) {
      Random random(options_.simulator.seed, 7, frame, std::uint64_t(y));
      std::size_t at = random.Below(std::uint32_t(normal_.size()));
      for (int x = 0; x < mean.width(); ++x, ++at) {
        const float dn = mean(x, y) + sigma_[mean(x, y)] * normal_[at % normal_.size()];
        noisy(x, y) = std::uint16_t(std::clamp(dn + 0.5f, 0.0f, highest));
      }
    });
    return noisy;
  }

  SimulatedCameraOptions options_;
  PixelFormat format_;
  json pictures_, frames_;  // settings that exposures_ and prepared_ were made with
  std::vector<Exposure> exposures_;
  std::vector<float> normal_, sigma_;
  std::vector<std::vector<std::uint8_t>> prepared_;
  std::uint64_t next_ = 0;
  bool triggered_ = false;
  int asked_ = 0;
  Pacer pacer_;
};

}  // namespace

OptionTable Table(SimulatedCameraOptions& options) {
  OptionTable table = Table(options.simulator);
  std::erase_if(table, [](const Option& o) {
    return o.name == "bits" || o.name == "masks" || o.name == "known-poses";
  });
  table.push_back(
      {"pixel-format", &options.pixel_format, "as the camera sends it, say Mono8, Mono12p, Mono12Packed"});
  table.push_back({"fps", &options.fps, "frames a second", "1/s", 0.01, 10000});
  table.push_back({"hold", &options.hold, "frames from one place before the next", "frame", 1, 1e6});
  table.push_back({"frame-loss", &options.frame_loss, "share of the frames that never come", "", 0, 1});
  table.push_back(
      {"prepared", &options.prepared,
       "rounds of frames made before the start and then sent again and again, to save time; 0: every "
       "frame is new",
       "", 0, 1000});
  return table;
}

std::unique_ptr<Camera> OpenSimulatedCamera(const SimulatedCameraOptions& options) {
  return std::make_unique<SimulatedCamera>(options);
}

}  // namespace polarscan
