// Times at which the host of a side does not run its program: proto/scene.proto, Host.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>

#include "common/signal/joints.hpp"
#include "proto/scene.pb.h"

namespace farhand {

class HostStalls {
 public:
  // Uses the seed of the scene. Without the setting the host never stalls.
  HostStalls(const scene::Scene& scene, bool master);

  // Asked with a time that does not fall.
  bool at(Nanoseconds t) noexcept {
    while (t >= until_) next();
    return t >= from_;
  }

 private:
  void next() noexcept;
  double unit() noexcept;  // in (0, 1)

  bool any_, random_;
  double longest_s_, every_s_;
  std::uint64_t state_;
  std::int64_t count_ = 0;
  Nanoseconds first_, from_ = 0, until_ = 0;
};

// For commands that run every tick: throws std::invalid_argument if a host is to stall.
inline void refuse_host_stalls(const scene::Scene& scene, const std::string& who) {
  if (!scene.master().has_host() && !scene.slave().has_host()) return;
  throw std::invalid_argument(std::string(scene.master().has_host() ? "master.host" : "slave.host") + ": " + who +
                              " runs every tick and stalls no host; leave the field out, or use farhand-lab run");
}

}  // namespace farhand
