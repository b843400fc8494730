// A whole session in virtual time in which every part can fail: both processes, their clocks, the network, the serial
// cable, and the orthosis with its MCU, supply and sensors. The stations, the codec, the sealing and the MCU core are
// those of the programs; packets arrive at ticks, as in the programs.
#pragma once

#include <deque>
#include <functional>
#include <memory>
#include <optional>
#include <random>
#include <vector>

#include "common/runtime/side.hpp"
#include "slave/mcu/emulator.hpp"

namespace farhand {

struct Letter {
  Nanoseconds due;
  std::vector<std::byte> bytes;
};

// One direction of the network.
struct Way {
  Nanoseconds delay;
  bool cut = false;                         // packets sent now are lost
  std::function<void(Packet<1>&)> content;  // changes the content of packets
  std::function<void(Way&, Letter)> carry;  // instead of post()
  std::deque<Letter> pending = {};          // the earliest due first

  void post(Letter letter);
};

struct Process {
  std::unique_ptr<Side> side;
  Way* in = nullptr;
  bool runs = true;
  Nanoseconds clock = 0;  // advance of its clock over the others
  Nanoseconds started = 0, ticked = 0;
};

// Between the slave's process and its orthosis.
struct Cable {
  bool from_mcu = true, to_mcu = true, plugged = true;
  double noise = 0;  // share of the bytes that are damaged, both ways
  // Effect of an adapter, a driver or a throttled line: bytes come later, in order. The adapter sends the bytes that it
  // has collected from the MCU when its latency timer ends, or when it has this number of bytes.
  Nanoseconds lag_to_mcu = 0, lag_from_mcu = 0;
  Nanoseconds latency_timer = 0;
  std::size_t collects = 62;
  double mcu_clock = 1.0;  // its rate
  std::mt19937_64 dice{1};
};

class FaultRig {
 public:
  // The scene must be complete; its network must be free of chance.
  explicit FaultRig(const scene::Scene& scene);
  ~FaultRig();

  Nanoseconds now;  // of the last tick
  Way forward, backward;
  Process master, slave;
  Cable cable;
  std::function<double(double)> master_reading, slave_reading;  // of the encoders; the slave's if it is a direct drive
  OperatorAct act = OperatorAct::kNone, patient_act = OperatorAct::kNone;  // in the next tick of their side

  void tick();
  // A new process in the place of the old one, with a new session, once the handshake is over.
  void restart_master();
  void restart_slave();
  // The slave's side is given another key than the master's.
  void change_key();
  void break_spring();

  // Null for a direct drive.
  OrthosisEmulator* orthosis() noexcept;

  // Present torque of the device on the hand, N m: the larger of the applied and the commanded one.
  double torque() const noexcept;
  double velocity() const noexcept;  // rad/s, of the hand
  bool lets_go() const noexcept;     // no torque is commanded, and the MCU, if any, is at rest

 private:
  struct Link;
  class Port;
  void start(Process& process, std::unique_ptr<Side> side);
  void run(Process& process, Way& out, OperatorAct& act);
  void deliver(Process& process);
  std::unique_ptr<Side> make_slave();

  scene::Scene scene_;
  Nanoseconds tick_;
  struct Byte {
    Nanoseconds due;
    std::uint8_t value;
  };
  void carry_to_mcu();
  void carry_from_mcu();
  Nanoseconds mcu_time(Nanoseconds t) const noexcept;

  std::unique_ptr<OrthosisOnSerial> orthosis_;
  std::deque<Byte> to_mcu_, from_mcu_, collected_;
  Nanoseconds sent_on_ = 0;  // by the adapter
  std::unique_ptr<Link> link_;
  std::uint32_t sessions_ = 0;
};

}  // namespace farhand
