// The sources of acts on a station, in the order of their priority.
#pragma once

#include <utility>

#include "common/config/operator_timeline.hpp"
#include "common/runtime/operator_input.hpp"
#include "common/runtime/station_ports.hpp"
#include "common/runtime/stop_input.hpp"

namespace farhand {

// The patient's stop; only on the slave.
class PatientsStop final : public ActSource {
 public:
  explicit PatientsStop(StopInput& input) noexcept : input_(input) {}
  Asked next(const TickTime&, double, const Side&, bool) noexcept override {
    const bool pressed = input_.pressed();
    if (!pressed) return pressed_ = false, Asked{};
    const char* said = input_.broken() ? "patient's stop: its input has ended" : "patient's stop: pressed";
    return {OperatorAct::kStop, std::exchange(pressed_, true) ? "" : said};
  }

 private:
  StopInput& input_;
  bool pressed_ = false;  // in the last tick
};

// Ctrl-Z stops the station before the program is suspended.
class StopToSuspend final : public ActSource {
 public:
  Asked next(const TickTime& time, double, const Side&, bool) noexcept override {
    if (!time.suspending) return suspending_ = false, Asked{};
    return {OperatorAct::kStop, std::exchange(suspending_, true) ? "" : "operator: suspends the program"};
  }

 private:
  bool suspending_ = false;
};

// Keys and words of the operator. They are read in every tick, so that no stop waits.
class OperatorsWords final : public ActSource {
 public:
  explicit OperatorsWords(OperatorInput& input) noexcept : input_(input) {}
  Asked next(const TickTime& time, double, const Side&, bool) noexcept override {
    return {input_.poll(time.now_ns).value_or(OperatorAct::kNone)};
  }

 private:
  OperatorInput& input_;
};

// The acts of the scene's operator on this side; they wait while another source acts.
class ScenesPeople final : public ActSource {
 public:
  ScenesPeople(const scene::Scene& scene, Role role) : timeline_(scene, role) {}
  Asked next(const TickTime& time, double t_s, const Side& side, bool taken) noexcept override {
    if (taken) return {};
    return {timeline_.next(t_s, both_ready(side, time.deadline_ns))};
  }

 private:
  OperatorTimeline timeline_;
};

}  // namespace farhand
