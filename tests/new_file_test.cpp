// The one way in which programs make files: new, regular, for their owner's eyes, never in the place of anything.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <csignal>

#include "common/files/output_stream.hpp"
#include "common/files/utf8.hpp"
#include "tests/support/scratch_directory.hpp"

namespace farhand {
namespace {

namespace fs = std::filesystem;

mode_t mode_of(const fs::path& file) {
  struct stat info {};
  EXPECT_EQ(::lstat(file.c_str(), &info), 0) << file;
  return info.st_mode & 07777;
}

class Umask {
 public:
  explicit Umask(mode_t mask) : before_(::umask(mask)) {}
  ~Umask() { ::umask(before_); }
  Umask(const Umask&) = delete;
  Umask& operator=(const Umask&) = delete;

 private:
  mode_t before_;
};

std::string refusal(const fs::path& file) {
  try {
    NewFile made(file);
    return "made " + made.file().string();
  } catch (const std::runtime_error& error) {
    return error.what();
  }
}

TEST(NewFile, NumbersStandBeforeTheExtension) {
  EXPECT_EQ(numbered("a/x.mcap", 1), "a/x.mcap");
  EXPECT_EQ(numbered("a/x.mcap", 2), "a/x-2.mcap");
  EXPECT_EQ(numbered("key", 3), "key-3");
  EXPECT_EQ(numbered(".hidden", 12), ".hidden-12");
}

TEST(NewFile, NeverTakesThePlaceOfAnything) {
  ScratchDirectory scratch;
  write_bytes(scratch / "x.csv", "first");
  fs::create_symlink(scratch / "x.csv", scratch / "x-2.csv");
  fs::create_symlink(scratch / "nowhere", scratch / "x-3.csv");
  fs::create_directory(scratch / "x-4.csv");
  OutputStream out(scratch / "x.csv");
  out << "fifth";
  out.finish();
  EXPECT_EQ(out.made().file(), scratch / "x-5.csv");
  EXPECT_EQ(other_name(out.made()), (scratch / "x-4.csv").string() +
                                        " and 3 more exist already and stay as they are: " +
                                        (scratch / "x-5.csv").string() + " is written instead");
  EXPECT_EQ(file_bytes(scratch / "x-5.csv"), "fifth");
  EXPECT_EQ(file_bytes(scratch / "x.csv"), "first");
  EXPECT_FALSE(fs::exists(scratch / "nowhere"));
  const std::vector<fs::path> all{scratch / "x.csv", scratch / "y.csv"};
  EXPECT_EQ(free_number(all), 6);
}

TEST(NewFile, CarriesItsSuffixUntilItIsComplete) {
  ScratchDirectory scratch;
  write_bytes(scratch / "x.mcap.part", "killed");
  NewFile file(scratch / "x.mcap", ".part");
  EXPECT_EQ(file.unfinished(), scratch / "x-2.mcap.part");
  write_bytes(scratch / "x-2.mcap", "came meanwhile");
  file.complete();
  EXPECT_EQ(file.file(), scratch / "x-3.mcap");
  EXPECT_FALSE(fs::exists(scratch / "x-2.mcap.part"));
  EXPECT_EQ(file_bytes(scratch / "x-2.mcap"), "came meanwhile");
  EXPECT_EQ(file_bytes(scratch / "x.mcap.part"), "killed");
  EXPECT_EQ(file.in_the_way(), (std::vector<fs::path>{scratch / "x.mcap.part", scratch / "x-2.mcap"}));
}

TEST(NewFile, RefusesWhatIsNoRegularFile) {
  ScratchDirectory scratch;
  fs::create_directory(scratch / "directory");
  ASSERT_EQ(::mkfifo((scratch / "pipe").c_str(), 0600), 0);
  const int listening = ::socket(AF_UNIX, SOCK_STREAM, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  (scratch / "socket").string().copy(address.sun_path, sizeof address.sun_path - 1);
  ASSERT_EQ(::bind(listening, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  fs::create_symlink("/dev/full", scratch / "link");
  EXPECT_NE(refusal(scratch / "directory").find("it is a directory, not a regular file"), std::string::npos);
  EXPECT_NE(refusal(scratch / "pipe").find("it is a pipe"), std::string::npos);
  EXPECT_NE(refusal(scratch / "socket").find("it is a socket"), std::string::npos);
  EXPECT_NE(refusal(scratch / "link").find("it is a device"), std::string::npos);
  EXPECT_NE(refusal("/dev/null").find("cannot write /dev/null: it is a device"), std::string::npos);
  EXPECT_NE(refusal(scratch / "none/x").find("No such file or directory"), std::string::npos);
  EXPECT_NE(refusal(scratch / "directory/").find("names no file"), std::string::npos);
  EXPECT_NE(refusal("").find("names no file"), std::string::npos);
  write_bytes(scratch / "file", "precious");
  EXPECT_NE(refusal(scratch / "file/x").find("is no directory"), std::string::npos) << refusal(scratch / "file/x");
  EXPECT_THROW(require_output_directory(scratch / "file/x"), std::runtime_error);
  EXPECT_THROW(make_directories(scratch / "file/x"), std::runtime_error);
  EXPECT_NO_THROW(require_output_directory(scratch / "a/b"));
  ::close(listening);
}

TEST(NewFile, IsForItsOwnerWhateverTheUmask) {
  for (const mode_t mask : {mode_t{0}, mode_t{022}, mode_t{0277}}) {
    ScratchDirectory scratch;
    const Umask umask(mask);
    const NewFile file(scratch / "x.mcap", ".part");
    EXPECT_EQ(mode_of(file.unfinished()), mode_t{0600});
    make_directories(scratch / "a/b");
    EXPECT_EQ(mode_of(scratch / "a"), mode_t{0700});
    EXPECT_EQ(mode_of(scratch / "a/b"), mode_t{0700});
    ASSERT_EQ(::chmod((scratch / "a").c_str(), 0755), 0);
    make_directories(scratch / "a/c");
    EXPECT_EQ(mode_of(scratch / "a"), mode_t{0755}) << "what was there keeps its mode";
  }
}

// The file may not grow beyond 100 kB: what a full disk looks like.
TEST(NewFile, HalfAResultIsSaidAndDoesNotStay) {
  ScratchDirectory scratch;
  rlimit old_limit{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &old_limit), 0);
  std::signal(SIGXFSZ, SIG_IGN);
  const rlimit limit{100'000, old_limit.rlim_max};
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &limit), 0);
  std::string said;
  try {
    OutputStream out(scratch / "x.csv");
    for (int i = 0; i < 200'000; ++i) out << 'x';
    out.finish();
  } catch (const std::runtime_error& error) {
    said = error.what();
  }
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &old_limit), 0);
  EXPECT_EQ(said, "could not write all of " + (scratch / "x.csv").string() + ": File too large");
  EXPECT_FALSE(fs::exists(scratch / "x.csv"));
}

TEST(Utf8, IsWhatTheStandardSays) {
  for (const char* good :
       {"", "plain", "caf\xc3\xa9", "\xe2\x82\xac", "\xf0\x9f\x99\x82", "\xef\xbf\xbd", "\xf4\x8f\xbf\xbf"})
    EXPECT_TRUE(is_utf8(good)) << good;
  for (const char* bad : {"\x80", "caf\xe9", "\xc0\xaf", "\xc1\xbf", "\xe0\x9f\xbf", "\xed\xa0\x80", "\xf0\x8f\xbf\xbf",
                          "\xf4\x90\x80\x80", "\xf5\x80\x80\x80", "\xff", "\xc3", "\xe2\x82", "\xf0\x9f\x99"}) {
    EXPECT_FALSE(is_utf8(bad)) << as_utf8(bad);
    EXPECT_TRUE(is_utf8(as_utf8(bad)));
  }
  EXPECT_EQ(as_utf8("caf\xe9 \xe2\x82\xac\xe2\x82"), "caf\\xe9 \xe2\x82\xac\\xe2\\x82");
}

}  // namespace
}  // namespace farhand
