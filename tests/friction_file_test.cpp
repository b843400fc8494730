// The file in which the friction of a patient's device is kept.
#include "common/runtime/friction_file.hpp"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <stdexcept>

#include "tests/support/scratch_directory.hpp"

namespace farhand {
namespace {

constexpr std::int64_t kDay = 86'400, kSwept = 1'796'117'400;  // 2026-12-01T09:30:00Z

std::string complaint(const std::string& text, mode_t mode = 0600) {
  ScratchDirectory scratch;
  const auto file = scratch / "friction";
  std::ofstream(file) << text;
  ::chmod(file.c_str(), mode);
  try {
    load_friction(file);
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find(file.string()), std::string::npos) << "names the file";
    return error.what();
  }
  return "";
}

TEST(FrictionFile, KeepsEverySweepAndTheLastOneCounts) {
  ScratchDirectory scratch;
  const auto file = scratch / "friction";
  EXPECT_FALSE(load_friction(file)) << "no file";
  add_friction(file, {kSwept, 0.0512, 0.0004});
  add_friction(file, {kSwept + kDay, 0.06, 0.001});
  std::ifstream in(file);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  EXPECT_EQ(text,
            "2026-12-01T09:30:00Z friction_nm 0.0512 spread_nm 0.0004\n"
            "2026-12-02T09:30:00Z friction_nm 0.0600 spread_nm 0.0010\n");
  struct stat info {};
  ASSERT_EQ(::stat(file.c_str(), &info), 0);
  EXPECT_EQ(info.st_mode & 0777, 0600u);
  const auto last = load_friction(file);
  ASSERT_TRUE(last);
  EXPECT_EQ(last->utc_s, kSwept + kDay);
  EXPECT_EQ(last->F_c, 0.06);
  EXPECT_EQ(last->spread, 0.001);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(scratch.path()), {}), 1) << "nothing else is left";
}

TEST(FrictionFile, WhatIsNotFromTodayIsOnlyAssumed) {
  const SweptFriction swept{kSwept, 0.04, 0.001};
  EXPECT_EQ(friction_for({}, kSwept).threshold, 0.1);
  EXPECT_FALSE(friction_for({}, kSwept).known);
  for (const std::int64_t age : {std::int64_t{-300}, std::int64_t{0}, kDay}) {
    EXPECT_EQ(friction_for(swept, kSwept + age).threshold, 0.04) << age;
    EXPECT_TRUE(friction_for(swept, kSwept + age).known) << age;
  }
  for (const std::int64_t age : {std::int64_t{-301}, kDay + 1}) {
    EXPECT_DOUBLE_EQ(friction_for(swept, kSwept + age).threshold, 0.06) << age;
    EXPECT_FALSE(friction_for(swept, kSwept + age).known) << age;
  }
  EXPECT_NE(friction_sentence(swept, kSwept).find("measured on 2026-12-01T09:30:00Z"), std::string::npos);
  EXPECT_NE(friction_sentence(swept, kSwept + 2 * kDay).find("more than a day ago"), std::string::npos);
  EXPECT_NE(friction_sentence(swept, kSwept - kDay).find("still to come"), std::string::npos);
  EXPECT_NE(friction_sentence({}, kSwept).find("never measured: 0.100 N m is assumed"), std::string::npos);
}

TEST(FrictionFile, WhatCannotBeReadIsRefusedByASentence) {
  const std::string good = "2026-12-01T09:30:00Z friction_nm 0.05 spread_nm 0.001\n";
  EXPECT_EQ(complaint(good), "");
  for (const char* bad :
       {"x\n", "\n", "2026-13-01T09:30:00Z friction_nm 0.05 spread_nm 0.001\n",
        "2026-12-01T09:30:00Z friction_nm 0.05\n", "2026-12-01T09:30:00Z friction_nm 0.05 spread_nm 0.001 more\n"}) {
    EXPECT_NE(complaint(good + bad).find("line 2: must be a date"), std::string::npos) << bad;
  }
  for (const char* value : {"-0.01", "0.51", "nan", "inf", "1e300"}) {
    const std::string told = complaint("2026-12-01T09:30:00Z friction_nm " + std::string(value) + " spread_nm 0.001\n");
    EXPECT_NE(told.find("line 1: friction_nm = "), std::string::npos) << told;
    EXPECT_NE(told.find("must be from 0 to 0.5 N m"), std::string::npos) << told;
  }
  EXPECT_NE(complaint("").find("is empty"), std::string::npos);
  EXPECT_NE(complaint(good, 0620).find("others may write"), std::string::npos);
  EXPECT_NE(complaint(good, 0602).find("others may write"), std::string::npos);
  ScratchDirectory scratch;
  std::filesystem::create_symlink(scratch / "elsewhere", scratch / "link");
  EXPECT_THROW(load_friction(scratch / "link"), std::invalid_argument);
  EXPECT_THROW(load_friction(scratch.path()), std::invalid_argument);
}

}  // namespace
}  // namespace farhand
