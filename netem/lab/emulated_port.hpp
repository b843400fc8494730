// The serial cable and the emulated orthosis behind it, in the form of a port for McuAxis.
#pragma once

#include <span>

#include "slave/emulator_params.hpp"

namespace farhand {

class EmulatedPort {
 public:
  explicit EmulatedPort(const scene::Scene& scene)
      : orthosis_(emulator_params(scene), scene.slave().series_elastic().serial_one_way_s()) {}

  std::size_t read(std::span<std::uint8_t> bytes, double t_s) noexcept {
    const Nanoseconds now = from_seconds(t_s);
    go_on(t_s);
    std::size_t count = 0;
    while (count < bytes.size() && orthosis_.receive(now, bytes[count])) ++count;
    return count;
  }
  void go_on(double t_s) noexcept { orthosis_.advance(from_seconds(t_s)); }
  bool write(std::span<const std::uint8_t> bytes, double t_s) noexcept {
    orthosis_.send(bytes.data(), bytes.size(), from_seconds(t_s));
    return true;
  }
  void drop_unsent(double t_s) noexcept { orthosis_.drop_unsent(from_seconds(t_s)); }
  bool lost() noexcept { return false; }

  Truth truth() const noexcept {
    const SeriesElasticWorld::Truth world = orthosis_.emulator().world().truth();
    return {world.x, world.v, world.f};
  }
  OrthosisOnSerial& orthosis() noexcept { return orthosis_; }

 private:
  OrthosisOnSerial orthosis_;
};

}  // namespace farhand
