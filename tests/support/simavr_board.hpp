// The firmware as it would be flashed, on simavr's ATmega1284P in virtual time, wired to the simulated orthosis as
// slave/mcu/avr/board.hpp says: quadrature counters, torque sensor, drive, the patient's stop, and a serial line at the
// real baud rate. simavr 1.6 counts cycles, but not the 4 of entering an interrupt and the 4 of waking for it; they are
// added here.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "common/plant/world.hpp"
#include "slave/mcu/avr/board_settings.hpp"

struct avr_t;

namespace farhand {

class SimavrBoard {
 public:
  // One pass of the 2 kHz interrupt, as the firmware's memory tells it.
  struct Loop {
    std::vector<std::uint8_t> bytes;  // that the core took from the line
    mcu::McuInput input;
    mcu::McuOutput output;
    std::uint64_t cycles;  // from the timer to the return, everything that interrupted it included
  };
  struct Interrupt {
    std::uint64_t count = 0, longest = 0, sum = 0;  // cycles from being due to having returned
  };

  // Throws std::runtime_error if the firmware or one of its symbols is not there.
  SimavrBoard(const std::string& elf, const SeriesElasticWorld::Params& world);
  ~SimavrBoard();
  SimavrBoard(const SimavrBoard&) = delete;

  std::function<void(const Loop&)> on_loop = [](const Loop&) {};
  std::function<void(std::uint8_t)> on_byte = [](std::uint8_t) {};  // has left the MCU
  std::function<void()> on_reset = [] {};

  // Leaves byte after byte from now on, 10 bits each.
  void send(const std::uint8_t* bytes, std::size_t count);
  void run_until(double t_s);
  double now() const;

  void press_stop(bool pressed);
  void press_release(bool pressed);
  // Supply below 4.3 V for `off_s`: the pins float, the drive stands; the counters live on. Memory is as it happens to
  // be.
  void brown_out(double off_s);
  void freeze_loop();                   // the timer's interrupt is masked: what a program that hangs looks like
  void offset_sensor(double torque_nm)  // of the spring's torque sensor
  {
    sensor_offset_nm_ = torque_nm;
  }

  const SeriesElasticWorld& world() const { return world_; }
  double motor_command() const { return motor_command_; }  // rad/s, what the drive is told
  std::uint16_t duty() const;
  bool drive_enabled() const;

  const Interrupt& loop_interrupt() const { return loop_; }
  const Interrupt& receive_interrupt() const { return receive_; }
  const Interrupt& send_interrupt() const { return send_; }
  std::uint64_t loops_late() const { return loops_late_; }
  std::size_t stack_left() const;  // bytes of memory that nothing has ever touched

 private:
  struct Hooks;
  friend Hooks;
  struct Symbols {
    std::size_t received, input, output, end;
  };

  void connect();
  void set_pins();
  void counter_bus(std::uint8_t port);
  void analog(unsigned channel);
  void update_drive();
  void advance_world();
  void loop_returned();
  std::uint64_t next_byte();
  std::uint64_t cycle() const;
  std::uint8_t& data(std::size_t address) const;

  avr_t* avr_;
  SeriesElasticWorld world_;
  mcu::McuSettings settings_ = mcu::board_settings();
  Symbols symbols_{};
  double sensor_offset_nm_ = 0, motor_command_ = 0;
  bool stop_ = false, release_ = false;
  std::int32_t latched_[2] = {0, 0};
  std::uint8_t ring_tail_ = 0;
  std::deque<std::uint8_t> to_mcu_;
  std::uint64_t line_free_at_ = 0;

  int loop_depth_ = 0;
  std::uint64_t loops_late_ = 0;
  Interrupt loop_, receive_, send_;
  std::uint64_t loop_due_ = 0, receive_due_ = 0, send_due_ = 0;
};

}  // namespace farhand
