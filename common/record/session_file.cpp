#include "common/record/session_file.hpp"

#include <algorithm>
#include <array>
#include <ctime>
#include <limits>
#include <stdexcept>

#include "common/files/output.hpp"
#include "common/files/utf8.hpp"
#include "common/record/mcap_reader.hpp"
#include "common/record/mcap_writer.hpp"
#include "common/record/stamps.hpp"

namespace farhand {

Recorded read_recording(const std::filesystem::path& file) {
  Recorded all;
  bool informed = false;
  record::StationSample station;
  record::LinkSample link;
  record::McuSample mcu;
  std::uint64_t undecodable = 0;
  const auto read = [&](const McapMessage& message) {
    const auto parse = [&](auto& into) {
      const bool ok = message.channel.schema_name == into.GetDescriptor()->full_name() &&
                      message.data.size() <= std::numeric_limits<int>::max() &&
                      into.ParseFromArray(message.data.data(), static_cast<int>(message.data.size()));
      if (!ok) ++undecodable;
      return ok;
    };
    const std::string& topic = message.channel.topic;
    if (topic == "/master" || topic == "/slave") {
      if (parse(station)) (topic == "/master" ? all.master : all.slave).emplace_back(station.t_ns(), decode(station));
    } else if (topic == "/netem") {
      if (parse(link)) all.link.emplace_back(link.t_ns(), decode(link));
    } else if (topic == "/mcu") {
      if (parse(mcu)) all.mcu.emplace_back(mcu.t_ns(), decode(mcu));
    } else if (topic == "/events") {
      if (!parse(all.events.emplace_back())) all.events.pop_back();
    } else if (topic == "/info") {
      informed = parse(all.info) || informed;
    }
  };
  all.problems = read_mcap(file, read).problems;
  if (!informed) throw std::runtime_error(file.string() + " is no recording of farhand: nothing tells which run it is");
  if (undecodable > 0) {
    all.problems.push_back(file.filename().string() + ": " + std::to_string(undecodable) +
                           " messages are not as expected");
  }
  return all;
}

std::filesystem::path write_session_mcap(const Session& session, const std::filesystem::path& file) {
  McapWriter out(file);
  const std::uint16_t info_channel = out.add_channel("/info", *record::RunInfo::descriptor());
  const std::uint16_t event_channel = out.add_channel("/events", *record::Event::descriptor());
  const std::uint16_t master_channel = out.add_channel("/master", *record::StationSample::descriptor());
  const std::uint16_t slave_channel = out.add_channel("/slave", *record::StationSample::descriptor());
  const std::uint16_t link_channel = out.add_channel("/netem", *record::LinkSample::descriptor());
  std::string bytes;
  const auto write = [&](std::uint16_t channel, double t_s, const auto& message) {
    message.SerializeToString(&bytes);
    out.write(channel, stamp_from_seconds(t_s), bytes);
  };
  // Chunks of a bounded number of messages: an indexed reader loads a chunk at a time.
  constexpr std::size_t kPerChunk = 4096;
  const auto write_series = [&](std::uint16_t channel, const auto& series, auto message) {
    for (std::size_t i = 0; i < series.size(); ++i) {
      encode(stamp_from_seconds(series[i].t_s), series[i], message);
      write(channel, series[i].t_s, message);
      if (i % kPerChunk == kPerChunk - 1) out.flush();
    }
    out.flush();
  };

  record::RunInfo info;
  info.set_scene_name(session.scene_name);
  info.set_scene_text(session.scene_text);
  info.set_seed(session.seed);
  info.set_role("session");
  info.set_deterministic(session.deterministic);
  info.set_clock_offset_s(session.clock_offset_s);
  info.set_clock_offset_bound_s(session.clock_offset_bound_s);
  name_signals(session.master_signals, session.slave_signals, info);
  encode(session.friction, info);
  for (const auto& [role, counters] :
       {std::pair{"master", &session.master_counters}, std::pair{"slave", &session.slave_counters}}) {
    record::Counters& message = *info.add_counters();
    encode(*counters, message);
    message.set_role(role);
  }
  write(info_channel, 0, info);
  for (const SessionEvent& event : session.events) {
    record::Event message;
    message.set_t_ns(stamp_from_seconds(event.t_s));
    message.set_who(as_utf8(event.who));
    message.set_text(as_utf8(event.text));
    write(event_channel, event.t_s, message);
  }
  write_series(master_channel, session.master, record::StationSample());
  write_series(slave_channel, session.slave, record::StationSample());
  write_series(link_channel, session.link, record::LinkSample());
  if (out.unwritten() > 0) {
    out.discard();  // it can be merged again
    throw std::runtime_error("cannot write " + file.string() + ": " + out.last_error());
  }
  out.close();
  return out.file().file();
}

Session read_session_mcap(const std::filesystem::path& file) {
  Recorded all = read_recording(file);
  if (!all.problems.empty()) throw std::runtime_error(all.problems.front());
  if (all.info.role() != "session") {
    throw std::runtime_error(file.string() + " is the recording of " + all.info.role() + ", not a merged session");
  }
  Session session;
  session.scene_name = all.info.scene_name();
  session.scene_text = all.info.scene_text();
  session.seed = all.info.seed();
  session.deterministic = all.info.deterministic();
  session.clock_offset_s = all.info.clock_offset_s();
  session.clock_offset_bound_s = all.info.clock_offset_bound_s();
  session.master_signals = signals_of(all.info, true);
  session.slave_signals = signals_of(all.info, false);
  session.friction = friction_of(all.info);
  for (const record::Counters& counters : all.info.counters()) {
    (counters.role() == "master" ? session.master_counters : session.slave_counters) = decode(counters);
  }
  const auto take = [](auto& series, auto& into) {
    into.reserve(series.size());
    for (auto& [t, sample] : series) into.emplace_back(sample).t_s = to_seconds(t);
    series = {};
  };
  take(all.master, session.master);
  take(all.slave, session.slave);
  take(all.link, session.link);
  for (const record::Event& event : all.events) {
    session.events.push_back({to_seconds(event.t_ns()), event.who(), event.text()});
  }
  return session;
}

std::string session_directory(const std::filesystem::path& root, std::int64_t utc_ns, const std::string& scene,
                              std::uint64_t seed) {
  const auto utc_s = static_cast<std::time_t>(utc_ns / kSecond);
  std::tm utc{};
  ::gmtime_r(&utc_s, &utc);
  std::array<char, 32> stamp{};
  std::strftime(stamp.data(), stamp.size(), "%Y%m%dT%H%M%SZ", &utc);
  // A scene may be named by a path; only its name becomes part of ours.
  const std::string name = std::filesystem::path(scene).stem().string();
  const std::string base = (root / (stamp.data() + ("-" + name) + "-" + std::to_string(seed))).string();
  make_directories(root);
  std::string path = base;
  for (int i = 2; !make_directory(path); ++i) path = base + "-" + std::to_string(i);
  return path;
}

}  // namespace farhand
