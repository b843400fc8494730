// Recording from a loop thread: everything arrives in order, nothing in the loop waits or allocates, what is lost is
// counted, and a killed process keeps every flushed chunk.
#include "common/record/recorder.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <limits>

#include "common/record/mcap_reader.hpp"
#include "tests/support/alloc_counter.hpp"
#include "tests/support/scratch_directory.hpp"

namespace farhand {
namespace {

record::RunInfo info_of(const std::string& role) {
  record::RunInfo info;
  info.set_role(role);
  info.set_scene_name("wall");
  info.set_scene_text("duration_s: 20\n");
  info.set_seed(7);
  info.set_start_ns(5 * kSecond);
  return info;
}

StationSample sample_of(int i) {
  StationSample sample;
  sample.state = i % 5;
  sample.x_rad = 0.1 * i;
  sample.v_rad_s = -1.0 / (i + 1);
  sample.true_x_rad = std::numeric_limits<double>::quiet_NaN();
  sample.true_f_nm = 1e-9 * i;
  sample.limits = static_cast<std::uint32_t>(i);
  sample.newest_peer_send_ns = 1'000'000'000'000'000 + i;
  return sample;
}

struct Read {
  std::vector<record::StationSample> samples;
  std::vector<record::Event> events;
  std::vector<record::RunInfo> infos;
  McapFindings found;
};

Read read(const std::filesystem::path& file) {
  Read all;
  all.found = read_mcap(file, [&](const McapMessage& message) {
    const auto parse = [&](auto& list) {
      EXPECT_TRUE(list.emplace_back().ParseFromArray(message.data.data(), static_cast<int>(message.data.size())));
    };
    if (message.channel.topic == "/master") parse(all.samples);
    if (message.channel.topic == "/events") parse(all.events);
    if (message.channel.topic == "/info") parse(all.infos);
  });
  return all;
}

TEST(Recorder, KeepsAHundredThousandSamplesInOrder) {
  constexpr int kCount = 100'000;
  ScratchDirectory scratch;
  Recorder recorder(scratch / "master.mcap", info_of("master"), kCount + 2);
  recorder.note(5 * kSecond, "engaged");
  for (int i = 0; i < kCount; ++i) recorder.push(5 * kSecond + i * kMillisecond, sample_of(i));
  StationCounters counters;
  counters.ticks = kCount;
  const RecordingOutcome outcome = recorder.finish(counters);
  EXPECT_EQ(outcome.problem, "");
  EXPECT_EQ(outcome.overflow + outcome.unwritten, 0u);
  EXPECT_EQ(outcome.written, kCount + 3u);  // with one event and two infos

  const Read all = read(outcome.file);
  EXPECT_TRUE(all.found.complete);
  ASSERT_EQ(all.samples.size(), static_cast<std::size_t>(kCount));
  for (int i = 0; i < kCount; ++i) {
    const record::StationSample& message = all.samples[static_cast<std::size_t>(i)];
    ASSERT_EQ(message.t_ns(), 5 * kSecond + i * kMillisecond);
    const StationSample sample = decode(message), expected = sample_of(i);
    ASSERT_EQ(sample.state, expected.state);
    ASSERT_EQ(sample.x_rad, expected.x_rad);
    ASSERT_EQ(sample.v_rad_s, expected.v_rad_s);
    ASSERT_TRUE(std::isnan(sample.true_x_rad));
    ASSERT_FALSE(message.has_true_x_rad());
    ASSERT_EQ(sample.true_f_nm, expected.true_f_nm);
    ASSERT_EQ(sample.limits, expected.limits);
    ASSERT_EQ(sample.newest_peer_send_ns, expected.newest_peer_send_ns);
  }
  ASSERT_EQ(all.events.size(), 1u);
  EXPECT_EQ(all.events[0].who(), "master");
  EXPECT_EQ(all.events[0].text(), "engaged");
  ASSERT_EQ(all.infos.size(), 2u);
  EXPECT_EQ(all.infos[0].counters_size(), 0);
  EXPECT_EQ(all.infos[1].scene_text(), "duration_s: 20\n");
  ASSERT_EQ(all.infos[1].counters_size(), 1);
  EXPECT_EQ(all.infos[1].counters(0).ticks(), static_cast<std::uint64_t>(kCount));
}

TEST(Recorder, CountsWhatFoundNoRoom) {
  ScratchDirectory scratch;
  Recorder recorder(scratch / "master.mcap", info_of("master"), 64);
  constexpr int kCount = 100'000;  // pushed within the writer's sleep or not: every sample is written or counted
  for (int i = 0; i < kCount; ++i) recorder.push(i, sample_of(i));
  const RecordingOutcome outcome = recorder.finish({});
  EXPECT_GT(outcome.overflow, 0u);
  const Read all = read(outcome.file);
  EXPECT_EQ(all.samples.size() + outcome.overflow, static_cast<std::size_t>(kCount));
  EXPECT_EQ(all.infos.back().counters(0).record_overflow(), outcome.overflow);
  EXPECT_NE(outcome.problem.find("has gaps"), std::string::npos);
  for (std::size_t i = 1; i < all.samples.size(); ++i) ASSERT_LT(all.samples[i - 1].t_ns(), all.samples[i].t_ns());
}

TEST(Recorder, PushTouchesNeitherHeapNorMutex) {
  if (kCounterIsBlind) GTEST_SKIP() << "a sanitizer owns malloc and the mutexes";
  ScratchDirectory scratch;
  Recorder recorder(scratch / "master.mcap", info_of("master"), 4096);  // overflows on the way: that must be as quiet
  const StationSample sample = sample_of(1);
  const TouchCounter counter;
  for (int i = 0; i < 10'000; ++i) {
    recorder.push(i, sample);
    if (i % 1000 == 0) recorder.note(i, "a sentence that no small string would hold without a heap");
  }
  EXPECT_EQ(counter.since(), Touched{});
  ::operator delete(::operator new(1));
  EXPECT_EQ(counter.since(), (Touched{2, 0}));  // it sees a deliberate one
  EXPECT_GT(recorder.finish({}).written, 4096u);
}

TEST(Recorder, CutsALongNote) {
  ScratchDirectory scratch;
  Recorder recorder(scratch / "master.mcap", info_of("master"));
  recorder.note(1, std::string(1000, 'x'));
  EXPECT_EQ(read(recorder.finish({}).file).events.at(0).text(), std::string(160, 'x'));
}

TEST(Recorder, ANameThatIsNoUtf8CostsNoRecording) {
  ScratchDirectory scratch;
  record::RunInfo info = info_of("master");
  info.set_scene_name("caf\xe9");
  Recorder recorder(scratch / "master.mcap", info);
  recorder.note(1, std::string(159, 'x') + "\xc3\xa9");  // its end lies within a character
  recorder.note(2, "broken \xff");
  const Read all = read(recorder.finish({}).file);
  ASSERT_EQ(all.infos.size(), 2u);
  EXPECT_EQ(all.infos[1].scene_name(), "caf\\xe9");
  ASSERT_EQ(all.events.size(), 2u);
  EXPECT_EQ(all.events[0].text(), std::string(159, 'x'));
  EXPECT_EQ(all.events[1].text(), "broken \\xff");
}

TEST(Recorder, ARecordingThatIsThereIsNeverTouched) {
  ScratchDirectory scratch;
  write_bytes(scratch / "master.mcap.part", "of a run that was killed");
  write_bytes(scratch / "master-2.mcap", "complete");
  Recorder recorder(scratch / "master.mcap", info_of("master"));
  recorder.push(1, sample_of(1));
  EXPECT_EQ(recorder.file().in_the_way(),
            (std::vector<std::filesystem::path>{scratch / "master.mcap.part", scratch / "master-2.mcap"}));
  write_bytes(scratch / "master-3.mcap", "of a program that was faster");
  const RecordingOutcome outcome = recorder.finish({});
  EXPECT_EQ(outcome.problem, "");
  EXPECT_EQ(outcome.file, scratch / "master-4.mcap");
  EXPECT_TRUE(read(outcome.file).found.complete);
  EXPECT_EQ(file_bytes(scratch / "master.mcap.part"), "of a run that was killed");
  EXPECT_EQ(file_bytes(scratch / "master-2.mcap"), "complete");
  EXPECT_EQ(file_bytes(scratch / "master-3.mcap"), "of a program that was faster");
}

TEST(Recorder, FlushesWhileItRuns) {
  ScratchDirectory scratch;
  Recorder recorder(scratch / "master.mcap", info_of("master"));
  for (int i = 0; i < 100; ++i) recorder.push(i, sample_of(i));
  while (recorder.flushed() < 101) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  const Read all = read(scratch / "master.mcap.part");
  EXPECT_EQ(all.samples.size(), 100u);
  EXPECT_FALSE(all.found.complete);
}

TEST(Recorder, LosesNoFlushedChunkWhenKilled) {
  ScratchDirectory scratch;
  int pipe_ends[2];
  ASSERT_EQ(::pipe(pipe_ends), 0);
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    Recorder recorder(scratch / "master.mcap", info_of("master"));
    bool told = false;
    for (int i = 0;; ++i) {
      recorder.push(i * kMillisecond, sample_of(i));
      std::this_thread::sleep_for(std::chrono::microseconds(100));
      const std::uint64_t flushed = recorder.flushed();
      if (!told && flushed > 1000) told = ::write(pipe_ends[1], &flushed, sizeof flushed) == sizeof flushed;
    }
  }
  std::uint64_t flushed = 0;
  ASSERT_EQ(::read(pipe_ends[0], &flushed, sizeof flushed), static_cast<ssize_t>(sizeof flushed));
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  ::close(pipe_ends[0]);
  ::close(pipe_ends[1]);

  const McapFindings found = recover_mcap(scratch / "master.mcap.part", scratch / "master.mcap");
  EXPECT_FALSE(found.complete);
  EXPECT_GE(found.messages, flushed);
  const Read all = read(scratch / "master.mcap");
  EXPECT_TRUE(all.found.complete);
  EXPECT_EQ(all.found.messages, found.messages);
  ASSERT_EQ(all.samples.size() + all.infos.size(), found.messages);
  for (std::size_t i = 0; i < all.samples.size(); ++i) {
    ASSERT_EQ(all.samples[i].t_ns(), static_cast<Nanoseconds>(i) * kMillisecond);
  }
}

TEST(Recorder, RefusesAFolderThatIsNotWritable) {
  EXPECT_THROW(Recorder("/proc/master.mcap", info_of("master")), std::runtime_error);
  EXPECT_THROW(Recorder("/nonexistent/master.mcap", info_of("master")), std::runtime_error);
  ScratchDirectory scratch;
  EXPECT_THROW(Recorder(scratch / "x.mcap", info_of("therapist")), std::invalid_argument);
}

// The file may not grow beyond 200 kB: what a full disk looks like to the writer.
TEST(Recorder, GoesOnWhenTheDiskIsFull) {
  ScratchDirectory scratch;
  rlimit old_limit{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &old_limit), 0);
  std::signal(SIGXFSZ, SIG_IGN);
  testing::internal::CaptureStderr();
  Recorder recorder(scratch / "master.mcap", info_of("master"));
  const rlimit limit{200'000, old_limit.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
  constexpr int kCount = 10'000;
  for (int i = 0; i < kCount; ++i) recorder.push(5 * kSecond + i * kMillisecond, sample_of(i));
  const RecordingOutcome outcome = recorder.finish({});
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &old_limit), 0);
  EXPECT_NE(testing::internal::GetCapturedStderr().find("File too large; the session goes on"), std::string::npos);
  EXPECT_GT(outcome.unwritten, 0u);
  EXPECT_FALSE(outcome.problem.empty());
  const Read all = read(outcome.file);
  EXPECT_GT(all.samples.size(), 0u);
  EXPECT_EQ(all.samples.size() + outcome.unwritten + outcome.overflow, static_cast<std::size_t>(kCount));
}

TEST(Recording, CutsChunksOfAQuarterSecondInVirtualTime) {
  ScratchDirectory scratch;
  Recording recording(scratch / "mcu.mcap", info_of("mcu"));
  for (int i = 0; i < 10'000; ++i) recording.write(5 * kSecond + i * kMillisecond, McuSample{});
  const RecordingOutcome outcome = recording.finish({});
  EXPECT_EQ(outcome.problem, "");
  const Read all = read(outcome.file);
  EXPECT_EQ(all.found.messages, 10'002u);
  EXPECT_GE(all.found.chunks, 40u);
  EXPECT_LE(all.found.chunks, 42u);
}

TEST(Recording, CountsSamplesThatItsRoleDoesNotHave) {
  ScratchDirectory scratch;
  Recording recording(scratch / "netem.mcap", info_of("netem"));
  recording.write(1, LinkSample{});
  recording.write(2, StationSample{});
  const RecordingOutcome outcome = recording.finish({});
  EXPECT_EQ(outcome.unwritten, 1u);
  EXPECT_EQ(outcome.written, 3u);
}

}  // namespace
}  // namespace farhand
