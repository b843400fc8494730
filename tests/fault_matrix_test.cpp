// Every row of the fault matrix, in virtual time: torque within the limit, no jump, the promised reaction times, and
// what it takes to work again.
#include "netem/lab/fault_matrix.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <set>

#include "netem/lab/fault_report.hpp"

namespace farhand::faults {
namespace {

const std::vector<Row>& all() {
  static const std::vector<Row> rows = faults::rows();
  return rows;
}

TEST(FaultMatrix, EveryFaultInEveryStateEndsAsExpected) {
  const std::vector<Result> results = run(all(), 2);
  std::printf("%s", text_of(results).c_str());
  for (const Result& r : results) EXPECT_EQ(r.complaint, "") << r.of->fault << " in " << name_of(r.of->at);
}

TEST(FaultMatrix, HasAtLeastSixtyRowsAndNamesEachOnce) {
  EXPECT_GE(all().size(), 60u);
  std::set<std::tuple<std::string, At, bool>> names;
  for (const Row& row : all()) {
    EXPECT_TRUE(names.insert({row.fault, row.at, row.direct}).second) << row.fault << " in " << name_of(row.at);
  }
}

// A judge that lets everything pass proves nothing.
TEST(FaultMatrix, TheJudgeFindsWhatIsNotAsExpected) {
  const Row row{"cut",
                At::kContact,
                {},
                {StationState::kHolding, StationState::kHolding, Reason::kPeerSilent, Reason::kPeerSilent, 131, 73}};
  const auto with = [&](const auto& change) {
    Result r{};
    r.of = &row;
    r.slave = r.master = StationState::kHolding;
    r.slave_reason = r.master_reason = Reason::kPeerSilent;
    r.slave_ms = r.master_ms = 131;
    r.let_go_ms = 73;
    r.torque_nm = kTorqueLimit;
    r.jump_rad = kJumpLimit;
    r.again = true;
    change(r);
    return complaint(row, r);
  };
  EXPECT_EQ(with([](Result&) {}), "");
  EXPECT_NE(with([](Result& r) { r.torque_nm = 3.001; }), "");
  EXPECT_NE(with([](Result& r) { r.torque_nm = NAN; }), "");
  EXPECT_NE(with([](Result& r) { r.jump_rad = 1.001e-3; }), "");
  EXPECT_NE(with([](Result& r) { r.slave = StationState::kEngaged; }), "");
  EXPECT_NE(with([](Result& r) { r.master = StationState::kEngaged; }), "");
  EXPECT_NE(with([](Result& r) { r.slave_reason = Reason::kOperator; }), "");
  EXPECT_NE(with([](Result& r) { r.master_reason = Reason::kOperator; }), "");
  EXPECT_NE(with([](Result& r) { r.slave_ms = 132; }), "");
  EXPECT_NE(with([](Result& r) { r.slave_ms = NAN; }), "");
  EXPECT_NE(with([](Result& r) { r.let_go_ms = NAN; }), "");
  EXPECT_NE(with([](Result& r) { r.again = false; }), "");
  EXPECT_NE(with([](Result& r) { r.without_remedy = true; }), "");
}

}  // namespace
}  // namespace farhand::faults
