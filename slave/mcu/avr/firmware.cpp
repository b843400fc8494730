// The firmware of the orthosis MCU on an ATmega1284P at 14.7456 MHz: the core in a 2 kHz interrupt, and as little
// hardware around it as it needs (board.hpp). The serial line interrupts that interrupt, so that no byte waits for a
// loop; frames are decoded and encoded by main in what time is left, at most a loop later. A loop that does not come
// feeds no watchdog: 15 ms later the chip is reset, its pins float, and the drive, whose enable is pulled down, stands.
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>

#include "slave/mcu/avr/board.hpp"
#include "slave/mcu/avr/mcu_constants.hpp"
#include "slave/mcu/orthosis_mcu_body.hpp"

// Full-swing crystal, slow start, brown-out at 4.3 V (below 4.1 V this clock is too fast), watchdog always on, no JTAG
// (it would take half of the counter's bus).
FUSES = {0xF7, static_cast<uint8_t>((FUSE_SPIEN) & (FUSE_WDTON)),
         static_cast<uint8_t>((FUSE_BODLEVEL1) & (FUSE_BODLEVEL0))};

namespace {

using namespace farhand::mcu;

constexpr uint8_t bit(uint8_t n) { return static_cast<uint8_t>(1 << n); }

struct BurntParams {
  constexpr const McuParams& get() const { return kParams; }
};

constexpr uint8_t kRing = 64;
struct Received {
  volatile uint8_t head, tail;  // written by the line, by main
  uint8_t bytes[kRing];
};
struct Sending {
  volatile uint8_t left;
  const uint8_t* next;
  uint8_t bytes[kWireBytes];
};

}  // namespace

// With C names, so that a debugger, or a simulator, finds what the core was told and what it said.
extern "C" {
Received mcu_received;
Sending mcu_sending;
McuInput mcu_input;
McuOutput mcu_output;
uint8_t mcu_restarts __attribute__((section(".noinit")));  // survives all but a loss of power
uint8_t mcu_reset_flags __attribute__((section(".noinit")));

// Before the C++ start-up: after a watchdog reset the watchdog still runs, at its shortest.
void keep_reset_flags() __attribute__((naked, used, section(".init3")));
void keep_reset_flags() {
  mcu_reset_flags = MCUSR;
  MCUSR = 0;
  mcu_restarts = (mcu_reset_flags & bit(PORF)) != 0 ? 0 : mcu_restarts + 1;
  wdt_enable(WDTO_15MS);
}
}

namespace {

OrthosisCore<BurntParams> core(BurntParams{}, static_cast<uint8_t>((mcu_reset_flags & 15) | (mcu_restarts << 4)));
volatile bool in_loop, late;

// Between main and the loop; main touches them with interrupts off.
FrameDecoder decoder;
volatile bool frame_in, frame_out;
Command command;
uint8_t crc_errors, framing_errors;
uint8_t telemetry_payload[kPayloadBytes];

// All four bytes, highest first: the first latches the count, the end of the fourth lets it run on.
int32_t read_counter(uint8_t axis) {
  const auto byte = [axis](uint8_t select) {
    PORTB = static_cast<uint8_t>(axis | select);
    __builtin_avr_delay_cycles(3);  // 65 ns from the select lines to the bus, and the input's synchroniser
    return PINC;
  };
  const uint8_t b3 = byte(bit(kSelect2));
  const uint8_t b2 = byte(bit(kSelect1) | bit(kSelect2));
  const uint8_t b1 = byte(0);
  const uint8_t b0 = byte(bit(kSelect1));
  PORTB = static_cast<uint8_t>(axis | bit(kOutputDisable));
  return static_cast<int32_t>((static_cast<uint32_t>(b3) << 24) | (static_cast<uint32_t>(b2) << 16) |
                              (static_cast<uint16_t>(b1) << 8) | b0);
}

// One conversion per loop, of the torque sensor every second time: each takes 113 us and is there at the next loop.
void read_analog() {
  static uint8_t turn = 0;
  const uint16_t counts = ADC;
  if ((turn & 1) == 0) mcu_input.sensor = static_cast<int16_t>(counts - kSensorCounts);
  if (turn == 1) mcu_input.temperature_c = temperature_c(counts);
  if (turn == 3) mcu_input.current = counts;
  turn = static_cast<uint8_t>((turn + 1) & 3);
  const uint8_t input = (turn & 1) == 0 ? kSensorInput : turn == 1 ? kTemperatureInput : kCurrentInput;
  ADMUX = static_cast<uint8_t>(bit(REFS0) | input);
  ADCSRA |= bit(ADSC);
}

void drive(int32_t motor_velocity) {
  const DriveSignal signal = drive_signal(motor_velocity, kDutyPerVelocity);
  if (signal.positive) {
    PORTD |= bit(kDirectionPin);
  } else {
    PORTD &= static_cast<uint8_t>(~bit(kDirectionPin));
  }
  // A duty of 0 would still be one cycle of 737, and the motor would creep.
  TCCR3A = static_cast<uint8_t>(signal.duty == 0 ? bit(WGM31) : bit(WGM31) | bit(COM3A1));
  OCR3A = signal.duty;
  PORTD |= bit(kEnablePin);
}

void run_loop() {
  mcu_input.joint_counts = read_counter(0);
  mcu_input.motor_counts = read_counter(bit(kMotorAxis));
  read_analog();
  const uint8_t pins = PIND;
  // Not debounced: the first sample of a press counts, and what bounces is latched already.
  mcu_input.stop = (pins & bit(kStopPin)) != 0;
  mcu_input.release = (pins & bit(kReleasePin)) == 0;
  mcu_input.overrun = late;
  late = false;

  core.count_line_errors(crc_errors, framing_errors);
  if (frame_in) {
    core.take(command);
    frame_in = false;
  }
  mcu_output = core.step(mcu_input);
  drive(mcu_output.motor_velocity);
  Telemetry frame;
  if (core.telemetry(frame)) {
    pack(frame, telemetry_payload);
    frame_out = true;
  }
  wdt_reset();
}

// One byte at a time; after a frame it waits until a loop has taken it. The loop sees a byte with all that it meant, or
// not yet.
void decode_line() {
  while (!frame_in && mcu_received.tail != mcu_received.head) {
    const uint8_t tail = mcu_received.tail;
    const bool complete = decoder.push(mcu_received.bytes[tail]);
    if (complete) command = unpack_command(decoder.payload());
    const uint8_t next = static_cast<uint8_t>((tail + 1) % kRing);
    const uint8_t crc = static_cast<uint8_t>(decoder.crc_errors() & 0xFF);
    const uint8_t framing = static_cast<uint8_t>(decoder.framing_errors() & 0xFF);
    cli();
    mcu_received.tail = next;
    crc_errors = crc;
    framing_errors = framing;
    frame_in = complete;
    sei();
  }
}

// A frame is gone 130 us before the next one is due; one that comes earlier waits.
void encode_telemetry() {
  if (!frame_out || mcu_sending.left != 0) return;
  uint8_t payload[kPayloadBytes];
  cli();
  for (uint8_t i = 0; i < kPayloadBytes; ++i) payload[i] = telemetry_payload[i];
  frame_out = false;
  sei();
  encode_frame(payload, mcu_sending.bytes);
  mcu_sending.next = mcu_sending.bytes;
  mcu_sending.left = kWireBytes;
  UCSR0B |= bit(UDRIE0);
}

void sleep_until_interrupted() {
  cli();
  if (frame_out || (!frame_in && mcu_received.tail != mcu_received.head)) {
    sei();
    return;
  }
  sleep_enable();
  sei();  // takes effect after the next instruction: no interrupt is slept through
  sleep_cpu();
  sleep_disable();
}

}  // namespace

ISR(TIMER1_COMPA_vect) {
  if (in_loop) {
    late = true;
    return;
  }
  in_loop = true;
  sei();
  run_loop();
  cli();
  in_loop = false;
}

ISR(USART0_RX_vect) {
  const uint8_t byte = UDR0;  // a byte with a framing error is as wrong as any other: the CRC finds it
  const uint8_t next = static_cast<uint8_t>((mcu_received.head + 1) % kRing);
  if (next == mcu_received.tail) return;
  mcu_received.bytes[mcu_received.head] = byte;
  mcu_received.head = next;
}

ISR(USART0_UDRE_vect) {
  UDR0 = *mcu_sending.next++;
  if (--mcu_sending.left == 0) UCSR0B &= static_cast<uint8_t>(~bit(UDRIE0));
}

int main() {
  PORTB = bit(kOutputDisable);
  DDRB = bit(kSelect1) | bit(kSelect2) | bit(kMotorAxis) | bit(kOutputDisable) | bit(6);
  PORTD = bit(kStopPin) | bit(kReleasePin);
  DDRD = bit(kEnablePin) | bit(kDirectionPin) | bit(1);

  TCCR3A = bit(WGM31);  // fast PWM up to ICR3, no prescaler
  TCCR3B = bit(WGM33) | bit(WGM32) | bit(CS30);
  ICR3 = kPwmTop;

  ADMUX = bit(REFS0);                                                     // 5 V
  ADCSRA = bit(ADEN) | bit(ADSC) | bit(ADPS2) | bit(ADPS1) | bit(ADPS0);  // clock / 128

  UBRR0 = kBaudDivider;
  UCSR0C = bit(UCSZ01) | bit(UCSZ00);
  UCSR0B = bit(RXCIE0) | bit(RXEN0) | bit(TXEN0);

  OCR1A = kCyclesPerLoop - 1;
  TCCR1B = bit(WGM12) | bit(CS10);
  TIMSK1 = bit(OCIE1A);

  set_sleep_mode(SLEEP_MODE_IDLE);
  sei();
  for (;;) {
    decode_line();
    encode_telemetry();
    sleep_until_interrupted();
  }
}
