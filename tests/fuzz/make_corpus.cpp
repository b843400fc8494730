// Writes the seeds of the fuzzers, DIRECTORY/TARGET/NAME, from the code that speaks each format: to be run again when a
// format changes. A seed whose name begins with "good" holds something that its target takes for valid. Files called
// found_* are not made here: each was once a finding.
#include <cstdio>
#include <filesystem>
#include <string>

#include "common/device/mcu_si.hpp"
#include "common/link/codec.hpp"
#include "common/record/mcap_writer.hpp"
#include "common/record/sample_codec.hpp"
#include "proto/record.pb.h"
#include "tests/fuzz/own_random.hpp"
#include "tests/support/handshake_network.hpp"
#include "tests/support/scratch_directory.hpp"

namespace farhand::fuzz {
namespace {

std::filesystem::path directory;

void seed(const std::string& target, const std::string& name, const std::string& bytes) {
  std::filesystem::create_directories(directory / target);
  write_bytes(directory / target / name, bytes);
}

std::string text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

void packets() {
  PacketCodec<1> one, filled({.previous = true});
  PacketCodec<2> two;
  Packet<1> packet{.session = 7,
                   .seq = 1,
                   .send_time_ns = kSecond,
                   .echo_session = 1,
                   .echo_seq = 5,
                   .echo_send_time_ns = kSecond / 2,
                   .echo_dwell_ns = 1000,
                   .expiry_ms = 500,
                   .state = StationState::kEngaged,
                   .limits = 1,
                   .motion = {}};
  packet.motion.x.setConstant(0.25);
  seed("packet", "good_one_joint", text_of(one.encode(packet)));
  seed("packet", "good_two_joints", text_of(two.encode({.session = 7, .seq = 1, .motion = {}})));
  std::string run, filled_run;  // in order, the second late, one again, a restart
  const std::pair<std::uint32_t, std::uint32_t> order[] = {{7, 1}, {7, 3}, {7, 2}, {7, 4}, {7, 4}, {8, 1}, {7, 5}};
  for (const auto& [session, seq] : order) {
    packet.session = session;
    packet.seq = seq;
    packet.send_time_ns = seq * kMillisecond;
    run += '\1' + text_of(one.encode(packet));
    packet.previous_age_ns = kMillisecond;
    packet.previous.x.setConstant(0.125);
    filled_run += '\x81' + text_of(filled.encode(packet));
  }
  seed("packet", "good_run", run);
  seed("packet", "good_run_with_previous", filled_run);
  seed("packet", "good_with_previous", text_of(filled.encode(packet)));
  packet.motion.x.setConstant(std::numeric_limits<double>::quiet_NaN());
  seed("packet", "not_a_number", text_of(one.encode(packet)));
}

std::string frame(const auto& message, bool wired) {
  std::array<std::uint8_t, mcu::kWireBytes> wire{};
  if (wired) {
    mcu::encode(message, wire.data());
    return {wire.begin(), wire.end()};
  }
  mcu::pack(message, wire.data());
  return {wire.begin(), wire.begin() + mcu::kPayloadBytes};
}

void serial() {
  std::string wired, ticks;
  for (std::uint8_t seq = 0; seq < 16; ++seq) {
    const mcu::Telemetry telemetry{mcu::State::kTrack, seq, 1000, -200, 0x40};
    if (seq < 4) wired += frame(telemetry, true);
    ticks += '\xC1' + frame(telemetry, false);
  }
  seed("serial_host", "good_frames", wired);
  seed("serial_host", "good_ticks", ticks);
  seed("serial_host", "torn", wired.substr(3, 25));

  // The choice of parameters, then acts: 0x40 a frame, 0x80 + n loops, 0xC0 + bits other readings, n < 64 raw bytes.
  for (const char choice : {'\0', '\1', '\2', '\4', '\x08'}) {
    std::string start(1, choice);
    std::uint8_t seq = 0;
    const auto send = [&](mcu::Mode mode, double x) {
      start += '\x40' + frame(mcu::make_command(mode, seq++, x, 0.1, 0.05), false) + '\x81';
    };
    send(mcu::Mode::kSafe, 0);
    for (int k = 0; k < 6; ++k) send(mcu::Mode::kTrack, 0.002 * k);
    const std::string tag(1, static_cast<char>('0' + choice));
    seed("serial_mcu", "good_start_then_silence_" + tag, start + "\xBF\xBF\xBF\xBF");
    if (choice == 0) {
      seed("serial_mcu", "good_start_then_stop_and_release", start + "\xC1\x88\xC0\x82\xC2\xBF\xBF\xBF\xBF\xBF");
      seed("serial_mcu", "good_start_then_jump", start + std::string("\xC8\x10\x27\x00\x00\xBF\xBF", 7));
      // 1600 counts are 0.5 rad, where x_ref never goes.
      seed("serial_mcu", "good_start_beyond_the_range",
           std::string("\0\xD8\x40\x06\0\0\x40\x06\0\0\x83", 11) + start.substr(1));
      seed("serial_mcu", "good_raw_frames",
           start + '\x14' + frame(mcu::make_command(mcu::Mode::kSafe, 1, 0, 0, 0), true) +
               frame(mcu::make_command(mcu::Mode::kTorque, 2, 0, 0, 1), true) + "\xBF");
    }
  }
}

void handshakes() {
  const PairingKey key = PairingKey::from_text(std::string(64, '5'));
  const auto greeting = [](Role role) {
    return Greeting{.role = role, .configuration = "0123456789abcdef", .program = "1.2.3"};
  };
  seed("handshake", "good_greeting", '\0' + encode_greeting(greeting(Role::kFollower)));
  Greeting other = greeting(Role::kFollower);
  other.units = "deg\n";
  seed("handshake", "good_greeting_of_another", '\0' + encode_greeting(other));

  // What the box of a whole handshake says to the station; who and when is the byte before its two of length.
  HandshakeNetwork network({}, 1);
  auto& box = network.add(
      std::make_unique<OwnRandom>(1, [&] { return Handshaker::dialer(key, greeting(Role::kFollower), kListenerAt); }),
      kDialerAt);
  auto& station = network.add(
      std::make_unique<OwnRandom>(2, [&] { return Handshaker::listener(key, greeting(Role::kLeader)); }), kListenerAt);
  std::string said(1, '\1'), from_station;
  network.on_path = [&](const UdpEndpoint& from, HandshakeDatagram& datagram) {
    if (from == kDialerAt) {
      said += std::string{'\0', static_cast<char>(datagram.size & 0xFF), static_cast<char>(datagram.size >> 8)};
      said += text_of(datagram.view());
    }
    return true;
  };
  network.run_until([&] { return !station.sessions.empty() && !box.sessions.empty(); }, kSecond);
  seed("handshake", "good_whole_of_the_box", said);
  seed("handshake", "good_hello", said.substr(0, 4 + static_cast<unsigned char>(said[2])));
  seed("handshake", "good_path_left_alone", "\2");
  seed("handshake", "good_path_drops_and_repeats", "\2\7\0\0\5\5\15\7\0\3\13\7\7");
  seed("handshake", "good_path_damages", std::string("\2\1\15\1\201\20\377\7\1\0\1\201\3\200\1\60\7", 17));
  seed("handshake", "good_path_cuts_and_sends_back", std::string("\2\2\100\26\36\6\16\2\5\7\26", 11));
  seed("handshake", "good_path_forged_alert",
       std::string("\2\7\4\17\25\376\375\0\0\0\0\0\0\0\0\0\2\2\50\4\17\25\376\375\0\0\0\0\0\0\0\1\0\2\2\50", 36));
  seed("handshake", "wrong_key", "\3\7\5\15");
}

void scenes() {
  const std::string base = "architecture: FOUR_CHANNEL\nduration_s: 10\n";
  seed("config", "good_shortest", base);
  seed("config", "good_groups",
       base +
           "seed: 3\nslave { hand { stiffness_nm_per_rad: 2 from_s: 1 until_s: 5 } }\n"
           "network { forward { delay_s: 0.1 loss: 0.01 } }\noperator_acts { at_s: 0.2 act: ENGAGE }\n"
           "windows { free { from_s: 1 until_s: 4 } }\n");
  seed("config", "good_sets",
       base +
           "--set duration_s=2e1\n--set slave.hand={stiffness_nm_per_rad: 5}\n--set operator_acts[0].at_s=1\n"
           "--set operator_acts[0].act=HOLD\n");
  seed("config", "mistakes", "architecture: FOUR_CHANEL\nduration_s: -1\nslave { hnad {} }\n--set a.b=c\n--set =\n");
}

void recordings() {
  const ScratchDirectory scratch;
  const auto write = [&](const std::string& name, bool close) {
    const auto file = scratch / name;
    McapWriter writer(file);
    const std::uint16_t info = writer.add_channel("/info", "farhand.record.RunInfo", "protobuf", "", "protobuf");
    const std::uint16_t master =
        writer.add_channel("/master", record::StationSample::descriptor()->full_name(), "protobuf", "", "protobuf");
    record::RunInfo run;
    run.set_role("master");
    run.set_scene_name("demo");
    writer.write(info, 1000, run.SerializeAsString());
    writer.flush();
    record::StationSample sample;
    for (int i = 0; i < 3; ++i) {
      StationSample row;
      encode(2000 + i, row, sample);
      writer.write(master, 2000 + i, sample.SerializeAsString());
      if (i == 1) writer.flush();
    }
    writer.flush();
    if (close) writer.close();
    return file_bytes(close ? file : writer.file().unfinished());
  };
  const std::string whole = write("whole", true), part = write("part", false);
  seed("recording", "good_whole", whole);
  seed("recording", "good_torn", part.substr(0, part.size() - 20));
  seed("recording", "no_recording", whole.substr(0, 8));
}

void keys() {
  seed("pairing_key", "good_as_stored", std::string(32, 'a') + std::string(32, '7') + "\n");
  seed("pairing_key", "good_with_space", " \t" + std::string(64, 'B') + "\r\n");
  seed("pairing_key", "short", std::string(63, '0'));
}

void commands() {
  seed("command", "good_v4", "127.0.0.1:7000\nengage\nhold\nstop\nreset\n");
  seed("command", "good_v6_in_pieces",
       "[::1]:0\neng\xFF"
       "age\n  reset \t\r\xFF\nnothing\nstop");
  seed("command", "good_localhost", "localhost:65535\nengage and hold\n");
  seed("command", "a_name", "example.org:80\n");
  const std::string silence = "\xFF\x78", second = "\xFF\x66";
  seed("command", "keys_letters_alone",
       "a\n" + silence + "e" + silence + "s" + silence + "r" + silence + "o" + silence + "i" + silence);
  seed("command", "keys_words",
       "a\n" + silence + "engage\n" + silence + "reset\r" + silence + "identify\n" + silence + "home\n" + silence);
  seed("command", "keys_names",
       "a\n" + silence + "Herr Meier\n" + silence +
           "e\xFF\x28r\xFF\x28i\xFF\x28k\xFF\x28"
           "a\n" +
           second);
  seed("command", "keys_edited",
       "a\n" + silence + "x\xC3\xBC\x7f\x7f" + silence + "e" + second + "ab\x15" + silence + "engagx\be\n" + silence);
  seed("command", "keys_escapes",
       "a\n" + silence + "\x1b[A" + silence + "e" + second + "\x1b[200~rm -r e\n\x1b[201~" + silence + "\x1bOr" +
           silence);
}

}  // namespace
}  // namespace farhand::fuzz

int main(int count, char** arguments) {
  using namespace farhand::fuzz;
  if (count != 2) return std::fprintf(stderr, "usage: farhand_fuzz_corpus DIRECTORY\n"), 2;
  directory = arguments[1];
  packets();
  serial();
  handshakes();
  scenes();
  recordings();
  keys();
  commands();
}
