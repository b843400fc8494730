#include "common/runtime/station_loop.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <optional>
#include <vector>

#include "common/law/architectures.hpp"
#include "common/record/sample.hpp"
#include "common/runtime/act_sources.hpp"
#include "common/runtime/program.hpp"
#include "common/runtime/tick_watchers.hpp"

namespace farhand {
namespace {

constexpr int kDatagramsPerTick = 256;  // a flood is answered by dropping the rest until the next tick
constexpr int kTicksToRest = 300;

}  // namespace

StationLoop::StationLoop(Side& side, double duration_s, const StationPorts& ports)
    : side_(side), duration_s_(duration_s), ports_(ports), codec_(side.packet_parts()) {}

bool StationLoop::operator()(const TickTime& time) noexcept {
  const double t_s = to_seconds(time.elapsed_ns);
  receive(time.now_ns);
  if (first_heard_s_ == 0.0 && side_.receiver().heard()) first_heard_s_ = t_s;
  const bool refused = ports_.link->refused() && !side_.receiver().heard();
  stopping_ = time.stopping || refused || t_s - first_heard_s_ >= duration_s_;
  // The tick belongs to its deadline: readings, play-out and stamps then keep even steps however late the thread
  // woke.
  const int ticks = 1 + static_cast<int>(std::min<std::uint64_t>(time.missed, 1'000'000));
  const Asked asked = next_act(time, t_s);
  const Packet<1> packet = side_.tick(time.deadline_ns, t_s, asked.act, ticks);
  if (ports_.link->send(codec_.encode(packet))) ++sent_;
  if (!ports_.watchers.empty()) {
    const StationCounters totals = counted();
    for (TickWatcher* watcher : ports_.watchers) watcher->ticked({time, t_s, side_, asked, totals});
  }
  return !(stopping_ && ++stopping_ticks_ > kTicksToRest);
}

void StationLoop::receive(Nanoseconds now) noexcept {
  alignas(8) std::array<std::byte, MediaSession::kLargestDatagram> buffer;  // libsrtp reads words
  ports_.link->advance(now);
  for (int i = 0; i < kDatagramsPerTick; ++i) {
    std::span<const std::byte> bytes;
    const PeerLink::Received received = ports_.link->receive(buffer, now, bytes);
    if (received == PeerLink::Received::kNothing) return;
    if (received == PeerLink::Received::kOther) continue;
    Packet<1> packet;
    const DecodeResult result = codec_.decode(bytes, packet);
    ++rejected_[static_cast<std::size_t>(result)];
    if (result != DecodeResult::kOk) continue;
    const Receipt receipt = side_.receive(packet, now);
    if (receipt == Receipt::kAccepted) ports_.link->accept();
  }
}

// A loop that comes to its end stops, whoever asks for what.
Asked StationLoop::next_act(const TickTime& time, double t_s) noexcept {
  Asked heard;
  for (ActSource* source : ports_.acts) {
    const bool taken = stopping_ || heard.act != OperatorAct::kNone;
    const Asked asked = source->next(time, t_s, side_, taken);
    if (!taken) heard = asked;
  }
  return stopping_ ? Asked{OperatorAct::kStop, ""} : heard;
}

StationCounters StationLoop::counters(const RunStats& stats) const noexcept {
  StationCounters total = counted();
  total.ticks = stats.ticks;
  total.overruns = stats.overruns;
  total.missed_ticks = stats.missed;
  return total;
}

StationCounters StationLoop::counted() const noexcept {
  StationCounters total = counters_of(side_.receiver().counters());
  total.sent = sent_;
  for (std::size_t i = 1; i < rejected_.size(); ++i) {
    const auto why = static_cast<DecodeResult>(i);
    (why == DecodeResult::kChecksum    ? total.rejected_checksum
     : why == DecodeResult::kNotFinite ? total.rejected_not_finite
                                       : total.rejected_format) += rejected_[i];
  }
  if (const ChannelCounters* security = ports_.link->security()) {
    total.rejected_checksum += security->forged;
    total.duplicate += security->replayed;
    total.rejected_format += security->malformed;
  }
  const LinkDrops drops = ports_.link->drops();
  total.rejected_foreign = drops.foreign;
  total.dropped_too_long = drops.too_long;
  total.dropped_by_kernel = drops.by_kernel;
  total.dropped_handshake = drops.handshake;
  total.send_failed = drops.send_failed;
  total.cut_ticks = side_.trace().cuts;
  const SerialCounters serial = side_.serial_counters();
  total.serial_sent = serial.sent;
  total.serial_received = serial.received;
  total.serial_crc_errors = serial.crc_errors;
  total.serial_need_us = static_cast<std::uint64_t>(std::lround(1e6 * serial.need_s));
  total.serial_most_us = static_cast<std::uint64_t>(std::lround(1e6 * serial.most_age_s));
  total.serial_warned = serial.warned;
  total.serial_sagged = serial.sagged;
  return total;
}

namespace {

// Refused, stopped, the device gone or in a fault at the end, or well.
int exit_code(const RunStats& stats, const Side& side, const PeerLink& link) {
  if (link.refused() && !side.receiver().heard()) return kExitUsage;
  if (!side.device_valid()) {
    std::fprintf(stderr, "the device is lost: no valid answer from its serial line at the end of the run\n");
    return kExitFailed;
  }
  if (side.trace().state == StationState::kFault) {
    const bool line = side.trace().reason == Reason::kLineSlow;
    std::fprintf(stderr, "ended in a fault: %s\n",
                 line ? slow_line_sentence(side.serial_counters().blind) : name_of(side.trace().reason));
    if (side.trace().reason == Reason::kAnotherAxis)
      std::fprintf(stderr, "identified: %s\n", name_of(side.trace().misfit));
    return kExitFailed;
  }
  if (stats.cause == StopCause::kSignal) return kExitStopped;
  if (link.security() != nullptr && link.security()->sessions == 0) {
    std::fprintf(stderr, "no secured link was ever made\n");
    return kExitFailed;
  }
  return kExitOk;
}

void print_security(const char* role, const ChannelCounters& c) {
  const auto number = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  std::printf(
      "farhand-%s: secured: %llu packets sealed, %llu opened, %llu sessions; rejected: %llu forged, %llu replayed, "
      "%llu of "
      "another address, %llu without a session, %llu malformed\n",
      role, number(c.sealed), number(c.opened), number(c.sessions), number(c.forged), number(c.replayed),
      number(c.foreign), number(c.no_session), number(c.malformed));
}

void print_drops(const char* role, const StationCounters& c) {
  if (dropped(c) + c.send_failed == 0) return;
  const auto number = [](std::uint64_t n) { return static_cast<unsigned long long>(n); };
  std::printf(
      "farhand-%s: dropped: %llu datagrams: %llu too long, %llu by the system (too long, or no room), %llu of senders "
      "without a session, %llu handshakes beyond their share, %llu forged or damaged, %llu repeated, %llu of no "
      "format, "
      "%llu of an older session, %llu expired, %llu not finite; %llu not sent\n",
      role, number(dropped(c)), number(c.dropped_too_long), number(c.dropped_by_kernel), number(c.rejected_foreign),
      number(c.dropped_handshake), number(c.rejected_checksum), number(c.duplicate), number(c.rejected_format),
      number(c.rejected_session), number(c.rejected_expired), number(c.rejected_not_finite), number(c.send_failed));
}

void print_cuts(const char* role, const StationCounters& c) {
  if (c.cut_ticks == 0) return;
  std::printf("farhand-%s: cut: in %llu ticks the other side wished for more than may be asked of this one\n", role,
              static_cast<unsigned long long>(c.cut_ticks));
}

// Of the patient's device, as the therapist's side sees them.
HarderTendons tendons_of(const StationSession& session) {
  if (session.role != Role::kLeader) return {};
  const scene::Scene& scene = session.scene.scene;
  const Architecture& laws = architecture(scene::Architecture_Name(scene.architecture()));
  return {names_of(laws.master.signals), scene.control().force_scale()};
}

DeviceFriction friction_of(const StationSession& session) {
  return session.friction != nullptr ? session.friction->in_force() : DeviceFriction{};
}

}  // namespace

int run_station(const StationSession& session) {
  const char* role = session.role == Role::kLeader ? "master" : "slave";
  const scene::Scene& scene = session.scene.scene;
  const std::unique_ptr<Recorder> recorder = start_recorder(session.record, session.scene, role, friction_of(session));
  ScenesPeople people(scene, session.role);
  OperatorsWords words(session.operator_input);
  StopToSuspend suspend;
  std::optional<PatientsStop> stop;
  if (session.stop_input != nullptr) stop.emplace(*session.stop_input);
  std::vector<ActSource*> acts{&suspend, &words, &people};
  if (stop) acts.insert(acts.begin(), &*stop);
  RunStats stats;
  StationCounters counters;
  {
    LiveStatusPrinter printer(session.quiet);
    StatusWatcher status(printer, session.role, tendons_of(session));
    std::optional<RecordingWatcher> recording;
    if (recorder) recording.emplace(*recorder, tendons_of(session));
    std::vector<TickWatcher*> watchers{&status};
    if (recording) watchers.push_back(&*recording);
    if (session.friction != nullptr) watchers.push_back(session.friction);
    StationLoop loop(session.side, scene.duration_s(), {.link = &session.link, .acts = acts, .watchers = watchers});
    LoopParams params = loop_params(scene, from_seconds(scene.tick_s()), session.stop);
    params.suspend = &session.suspend;
    stats = run(params, loop);
    counters = loop.counters(stats);
  }
  finish_recorder(recorder.get(), counters, friction_of(session));
  print_loop(role, stats);
  if (const ChannelCounters* security = session.link.security()) print_security(role, *security);
  print_drops(role, counters);
  print_cuts(role, counters);
  return exit_code(stats, session.side, session.link);
}

}  // namespace farhand
