// Where the results of the lab's commands go: into a whole file, to standard output, or nowhere; never silently
// elsewhere.
#include "netem/lab/write_to.hpp"

#include <gtest/gtest.h>

#include <iterator>

#include "tests/support/scratch_directory.hpp"

namespace farhand {
namespace {

TEST(WriteTo, AFileGetsAllOfIt) {
  ScratchDirectory scratch;
  const std::string path = (scratch / "x.csv").string();
  write_to(path, [](std::ostream& out) { out << "a,b\n1,2\n"; });
  std::ifstream file(path);
  EXPECT_EQ(std::string(std::istreambuf_iterator<char>(file), {}), "a,b\n1,2\n");
}

TEST(WriteTo, WhatCannotBeWrittenIsSaidAndGoesNowhereElse) {
  ScratchDirectory scratch;
  const std::string path = (scratch / "none/x.csv").string();
  testing::internal::CaptureStdout();
  try {
    write_to(path, [](std::ostream& out) { out << "lost"; });
    ADD_FAILURE() << "nothing was said";
  } catch (const std::runtime_error& error) {
    EXPECT_NE(
        std::string(error.what()).find("cannot write " + path + ": " + (scratch / "none").string() + ": No such file"),
        std::string::npos);
  }
  EXPECT_THROW(write_to("/dev/full", [](std::ostream& out) { out << "lost"; }), std::runtime_error);
  write_to("", [](std::ostream& out) { out << "not asked for"; });
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "");
}

TEST(WriteTo, WhatExistsStaysAndTheOtherNameIsSaid) {
  ScratchDirectory scratch;
  const std::string path = (scratch / "x.csv").string();
  write_bytes(path, "precious");
  testing::internal::CaptureStderr();
  EXPECT_EQ(write_to(path, [](std::ostream& out) { out << "new"; }), scratch / "x-2.csv");
  EXPECT_EQ(testing::internal::GetCapturedStderr(),
            path + " exists already and stays as it is: " + (scratch / "x-2.csv").string() + " is written instead\n");
  EXPECT_EQ(file_bytes(path), "precious");
  EXPECT_EQ(file_bytes(scratch / "x-2.csv"), "new");
}

// Half a result looks like a whole one; the first rows of a table do not.
TEST(WriteTo, WhatEndsInTheMiddleLeavesRowsAndNothingElse) {
  ScratchDirectory scratch;
  const auto half = [](std::ostream& out) {
    out << "a row\n" << std::flush;
    throw std::runtime_error("no more");
  };
  EXPECT_THROW(write_to((scratch / "whole").string(), half), std::runtime_error);
  EXPECT_FALSE(std::filesystem::exists(scratch / "whole"));
  EXPECT_THROW(write_to((scratch / "rows").string(), half, Partial::kKept), std::runtime_error);
  EXPECT_EQ(file_bytes(scratch / "rows"), "a row\n");
}

TEST(WriteTo, ADashIsStandardOutput) {
  testing::internal::CaptureStdout();
  write_to("-", [](std::ostream& out) { out << "here"; });
  EXPECT_EQ(testing::internal::GetCapturedStdout(), "here");
}

}  // namespace
}  // namespace farhand
