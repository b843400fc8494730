#include "tests/support/simavr_board.hpp"

#include <fcntl.h>
#include <gelf.h>
#include <simavr/avr_adc.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_timer.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_interrupts.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <stdexcept>

#ifdef __SANITIZE_ADDRESS__
// simavr gives back neither its wires nor what it read of the firmware.
extern "C" const char* __lsan_default_suppressions();
extern "C" const char* __lsan_default_suppressions() { return "leak:libsimavr"; }
#endif

namespace farhand {
namespace {

// Data addresses and interrupt vectors of the ATmega1284P.
enum : std::size_t { kPinC = 0x26, kPinD = 0x29, kDdrB = 0x24, kDdrD = 0x2A, kPortD = 0x2B };
enum : std::size_t { kTimsk1 = 0x6F, kOcr3aLow = 0x98, kOcr3aHigh = 0x99, kTccr3a = 0x90 };
enum : std::uint8_t { kTimer1CompareA = 13, kUsart0Received = 20, kUsart0Empty = 21 };
constexpr std::size_t kRamEnd = 0x40FF;
constexpr std::uint64_t kCyclesPerByte = 10 * mcu::kClockHz / mcu::kBaud;
constexpr std::uint64_t kEntryCycles = 4 + 4;
constexpr std::uint8_t kUntouched = 0xA5;

std::map<std::string, std::size_t> symbols_of(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) throw std::runtime_error("there is no firmware " + path);
  elf_version(EV_CURRENT);
  Elf* elf = elf_begin(file, ELF_C_READ, nullptr);
  std::map<std::string, std::size_t> symbols;
  for (Elf_Scn* section = nullptr; elf != nullptr && (section = elf_nextscn(elf, section)) != nullptr;) {
    GElf_Shdr header;
    if (gelf_getshdr(section, &header) == nullptr || header.sh_type != SHT_SYMTAB) continue;
    Elf_Data* data = elf_getdata(section, nullptr);
    for (std::size_t i = 0; i < header.sh_size / header.sh_entsize; ++i) {
      GElf_Sym symbol;
      if (gelf_getsym(data, static_cast<int>(i), &symbol) == nullptr) continue;
      const char* name = elf_strptr(elf, header.sh_link, symbol.st_name);
      symbols[name] = symbol.st_value & 0xFFFF;  // data addresses carry 0x800000
    }
  }
  elf_end(elf);
  ::close(file);
  return symbols;
}

void be_silent(avr_t*, int, const char*, va_list) {}
void do_not_sleep(avr_t*, avr_cycle_count_t) {}

}  // namespace

struct SimavrBoard::Hooks {
  static SimavrBoard& board(void* self) { return *static_cast<SimavrBoard*>(self); }
  static void port_b(avr_irq_t*, std::uint32_t value, void* self) {
    board(self).counter_bus(static_cast<std::uint8_t>(value));
  }
  static void drive(avr_irq_t*, std::uint32_t, void* self) { board(self).update_drive(); }
  static void conversion(avr_irq_t*, std::uint32_t value, void* self) {
    union {
      avr_adc_mux_t mux;
      std::uint32_t v;
    } e{};
    e.v = value;
    board(self).analog(e.mux.src);
  }
  static void byte_out(avr_irq_t*, std::uint32_t value, void* self) {
    board(self).on_byte(static_cast<std::uint8_t>(value));
  }
  static avr_cycle_count_t byte_in(avr_t*, avr_cycle_count_t, void* self) { return board(self).next_byte(); }

  static void due(avr_irq_t*, std::uint32_t raised, std::uint64_t& at, const SimavrBoard& board) {
    if (raised != 0) at = board.cycle();
  }
  static void returned(std::uint64_t due_at, Interrupt& interrupt, const SimavrBoard& board) {
    const std::uint64_t took = board.cycle() - due_at + kEntryCycles;
    ++interrupt.count;
    interrupt.sum += took;
    interrupt.longest = std::max(interrupt.longest, took);
  }
  static void loop_due(avr_irq_t* irq, std::uint32_t raised, void* self) {
    if (board(self).loop_depth_ == 0) due(irq, raised, board(self).loop_due_, board(self));
  }
  static void loop_running(avr_irq_t*, std::uint32_t running, void* self) {
    SimavrBoard& b = board(self);
    if (running != 0) {
      if (++b.loop_depth_ > 1) ++b.loops_late_;
    } else if (--b.loop_depth_ == 0) {
      returned(b.loop_due_, b.loop_, b);
      b.loop_returned();
    }
  }
  static void receive_due(avr_irq_t* irq, std::uint32_t raised, void* self) {
    due(irq, raised, board(self).receive_due_, board(self));
  }
  static void receive_running(avr_irq_t*, std::uint32_t running, void* self) {
    if (running == 0) returned(board(self).receive_due_, board(self).receive_, board(self));
  }
  static void send_due(avr_irq_t* irq, std::uint32_t raised, void* self) {
    due(irq, raised, board(self).send_due_, board(self));
  }
  static void send_running(avr_irq_t*, std::uint32_t running, void* self) {
    if (running == 0) returned(board(self).send_due_, board(self).send_, board(self));
  }
};

SimavrBoard::SimavrBoard(const std::string& elf, const SeriesElasticWorld::Params& world)
    : avr_(avr_make_mcu_by_name("atmega1284p")), world_(world) {
  if (avr_ == nullptr) throw std::runtime_error("this simavr knows no ATmega1284P");
  avr_global_logger_set(be_silent);
  const auto symbols = symbols_of(elf);
  const auto address = [&](const char* name) {
    const auto found = symbols.find(name);
    if (found == symbols.end()) throw std::runtime_error(elf + " has no symbol " + name);
    return found->second;
  };
  symbols_ = {address("mcu_received"), address("mcu_input"), address("mcu_output"), address("_end")};
  elf_firmware_t firmware{};
  if (elf_read_firmware(elf.c_str(), &firmware) != 0) throw std::runtime_error(elf + " cannot be loaded");
  avr_init(avr_);
  firmware.frequency = mcu::kClockHz;
  firmware.vcc = firmware.avcc = firmware.aref = mcu::kReferenceMillivolts;
  avr_load_firmware(avr_, &firmware);
  avr_->sleep = do_not_sleep;
  for (std::size_t a = symbols_.end; a <= kRamEnd; ++a) data(a) = kUntouched;
  connect();
  set_pins();
}

SimavrBoard::~SimavrBoard() {
  avr_terminate(avr_);
  std::free(avr_);
}

void SimavrBoard::connect() {
  const auto hook = [this](avr_irq_t* irq, avr_irq_notify_t notify) { avr_irq_register_notify(irq, notify, this); };
  hook(avr_io_getirq(avr_, AVR_IOCTL_IOPORT_GETIRQ('B'), IOPORT_IRQ_REG_PORT), Hooks::port_b);
  hook(avr_io_getirq(avr_, AVR_IOCTL_IOPORT_GETIRQ('D'), IOPORT_IRQ_REG_PORT), Hooks::drive);
  hook(avr_io_getirq(avr_, AVR_IOCTL_TIMER_GETIRQ('3'), TIMER_IRQ_OUT_PWM0), Hooks::drive);
  hook(avr_io_getirq(avr_, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_OUT_TRIGGER), Hooks::conversion);
  std::uint32_t flags = 0;  // no printing, no sleeping on the host
  avr_ioctl(avr_, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
  hook(avr_io_getirq(avr_, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), Hooks::byte_out);
  const auto watch = [&](std::uint8_t vector, avr_irq_notify_t due, avr_irq_notify_t running) {
    avr_irq_t* irq = avr_get_interrupt_irq(avr_, vector);
    hook(irq + AVR_INT_IRQ_PENDING, due);
    hook(irq + AVR_INT_IRQ_RUNNING, running);
  };
  watch(kTimer1CompareA, Hooks::loop_due, Hooks::loop_running);
  watch(kUsart0Received, Hooks::receive_due, Hooks::receive_running);
  watch(kUsart0Empty, Hooks::send_due, Hooks::send_running);
}

std::uint64_t SimavrBoard::cycle() const { return avr_->cycle; }
double SimavrBoard::now() const { return static_cast<double>(avr_->cycle) / mcu::kClockHz; }
std::uint8_t& SimavrBoard::data(std::size_t address) const { return avr_->data[address]; }

void SimavrBoard::run_until(double t_s) {
  const auto until = static_cast<std::uint64_t>(std::llround(t_s * mcu::kClockHz));
  while (avr_->cycle < until) {
    const auto before = avr_->run;
    const int state = avr_run(avr_);
    if (state == cpu_Crashed || state == cpu_Done) throw std::runtime_error("the firmware crashed");
    if (before != avr_->run && avr_->pc == 0) {  // the watchdog's reset
      set_pins();
      ring_tail_ = 0;
      loop_depth_ = 0;
      update_drive();
      on_reset();
      if (!to_mcu_.empty()) avr_cycle_timer_register(avr_, 1, Hooks::byte_in, this);
    }
  }
}

void SimavrBoard::send(const std::uint8_t* bytes, std::size_t count) {
  const bool idle = to_mcu_.empty();
  to_mcu_.insert(to_mcu_.end(), bytes, bytes + count);
  if (!idle) return;
  const std::uint64_t wait = line_free_at_ > avr_->cycle ? line_free_at_ - avr_->cycle : 0;
  avr_cycle_timer_register(avr_, wait + 1, Hooks::byte_in, this);
}

// The start bit of a byte; simavr tells the firmware when it is complete. Returns when the next one starts.
std::uint64_t SimavrBoard::next_byte() {
  avr_irq_t* input = avr_io_getirq(avr_, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT);
  avr_raise_irq(input, to_mcu_.front());
  to_mcu_.pop_front();
  line_free_at_ = avr_->cycle + kCyclesPerByte;
  return to_mcu_.empty() ? 0 : line_free_at_;
}

void SimavrBoard::set_pins() {
  std::uint8_t pins = 0xFF;
  if (!stop_) pins = static_cast<std::uint8_t>(pins & ~(1 << mcu::kStopPin));
  if (release_) pins = static_cast<std::uint8_t>(pins & ~(1 << mcu::kReleasePin));
  avr_ioport_external_t wires{};
  wires.name = 'D';
  wires.mask = (1 << mcu::kStopPin) | (1 << mcu::kReleasePin);
  wires.value = pins & wires.mask;
  avr_ioctl(avr_, AVR_IOCTL_IOPORT_SET_EXTERNAL('D'), &wires);
  data(kPinD) = pins;
}
void SimavrBoard::press_stop(bool pressed) {
  stop_ = pressed;
  set_pins();
}
void SimavrBoard::press_release(bool pressed) {
  release_ = pressed;
  set_pins();
}

void SimavrBoard::brown_out(double off_s) {
  avr_reset(avr_);
  loop_depth_ = 0;
  ring_tail_ = 0;
  to_mcu_.clear();
  set_pins();
  update_drive();
  for (std::size_t a = 0x100; a < symbols_.end - 2; ++a) data(a) = static_cast<std::uint8_t>(data(a) ^ (a * 37));
  avr_->cycle += static_cast<std::uint64_t>(off_s * mcu::kClockHz);
  avr_regbit_set(avr_, avr_->reset_flags.borf);
  on_reset();
}
void SimavrBoard::freeze_loop() { data(kTimsk1) = 0; }

void SimavrBoard::advance_world() { world_.advance(motor_command_, now()); }

// HCTL-2032: selecting the highest byte latches the count.
void SimavrBoard::counter_bus(std::uint8_t port) {
  const auto high = [port](std::uint8_t pin) { return ((port >> pin) & 1) != 0; };
  if (high(mcu::kOutputDisable) || (data(kDdrB) & 15) != 15) {
    data(kPinC) = 0xFF;
    return;
  }
  const bool motor = high(mcu::kMotorAxis), select1 = high(mcu::kSelect1), select2 = high(mcu::kSelect2);
  if (!select1 && select2) {
    advance_world();
    const double unit = mcu::encoder_unit_rad(motor ? settings_.motor_counts_per_rev : settings_.joint_counts_per_rev);
    const double angle = motor ? world_.motor_encoder() : world_.encoder();
    latched_[motor] = static_cast<std::int32_t>(std::lround(angle / unit));
  }
  const int shift = !select1 && select2 ? 24 : select1 && select2 ? 16 : !select1 ? 8 : 0;
  data(kPinC) = static_cast<std::uint8_t>((static_cast<std::uint32_t>(latched_[motor]) >> shift) & 0xFF);
}

void SimavrBoard::analog(unsigned channel) {
  advance_world();
  const double torque = world_.truth().spring_torque;
  double counts = 0;
  if (channel == mcu::kSensorInput) {
    counts = mcu::kSensorCounts * (1 + (torque + sensor_offset_nm_) / settings_.spring_sensor_nm);
  } else if (channel == mcu::kTemperatureInput) {
    counts = 25 * 0.01 * 1024 / 5;
  } else if (channel == mcu::kCurrentInput) {
    counts = std::fabs(torque) / mcu::kMotorTorqueNmPerA * mcu::kCurrentCounts;
  }
  const double millivolts = std::clamp(counts, 0.0, 1023.0) * mcu::kReferenceMillivolts / 1023;  // simavr's scale
  avr_raise_irq(avr_io_getirq(avr_, AVR_IOCTL_ADC_GETIRQ, static_cast<int>(ADC_IRQ_ADC0 + channel)),
                static_cast<std::uint32_t>(std::lround(millivolts)));
}

std::uint16_t SimavrBoard::duty() const {
  const bool connected = (data(kTccr3a) & 0xC0) == 0x80 && (data(kDdrB) & (1 << 6)) != 0;
  if (!connected) return 0;
  return static_cast<std::uint16_t>(data(kOcr3aLow) | (data(kOcr3aHigh) << 8));
}
bool SimavrBoard::drive_enabled() const { return (data(kDdrD) & data(kPortD) & (1 << mcu::kEnablePin)) != 0; }

// A drive that is not enabled, or whose pins float, stands.
void SimavrBoard::update_drive() {
  advance_world();
  const double sign = (data(kPortD) & (1 << mcu::kDirectionPin)) != 0 ? 1 : -1;
  motor_command_ = drive_enabled() ? sign * duty() * settings_.motor_speed_limit / mcu::kPwmTop : 0;
}

void SimavrBoard::loop_returned() {
  const auto read32 = [this](std::size_t a) {
    std::int32_t value;
    std::memcpy(&value, &data(a), 4);
    return value;
  };
  const auto read16 = [this](std::size_t a) { return static_cast<std::uint16_t>(data(a) | (data(a + 1) << 8)); };
  Loop loop;
  const std::uint8_t tail = data(symbols_.received + 1);
  for (; ring_tail_ != tail; ring_tail_ = static_cast<std::uint8_t>((ring_tail_ + 1) % 64)) {
    loop.bytes.push_back(data(symbols_.received + 2 + ring_tail_));
  }
  const std::size_t in = symbols_.input;
  loop.input = {read32(in),         read32(in + 4),     static_cast<std::int8_t>(data(in + 8)),     data(in + 9) != 0,
                data(in + 10) != 0, data(in + 11) != 0, static_cast<std::int16_t>(read16(in + 12)), read16(in + 14)};
  loop.output = {read32(symbols_.output), static_cast<mcu::State>(data(symbols_.output + 4))};
  loop.cycles = avr_->cycle - loop_due_ + kEntryCycles;
  on_loop(loop);
}

std::size_t SimavrBoard::stack_left() const {
  std::size_t a = symbols_.end;
  while (a <= kRamEnd && data(a) == kUntouched) ++a;
  return a - symbols_.end;
}

}  // namespace farhand
