// The catalogue of stiff and extreme cases: a quick cut by default, all of it at night.
#include "netem/lab/extreme.hpp"

#include <gtest/gtest.h>

#include <set>

#include "netem/lab/extreme_report.hpp"

namespace farhand::extreme {
namespace {

void expect_as_expected(const std::vector<Result>& results) {
  for (const Result& r : results)
    EXPECT_EQ(r.complaint, "") << r.of->family << ": " << r.of->name << "\n" << r.outcome.what;
}

// Every fourth of the cases that are quick.
std::vector<Case> quick_cut() {
  std::vector<Case> cut;
  int k = 0;
  for (Case& c : catalogue()) {
    if (c.quick && k++ % 4 == 0) cut.push_back(std::move(c));
  }
  return cut;
}

TEST(Extreme, AQuickCutComesOutAsExpectedForAnyNumberOfThreads) {
  const std::vector<Case> cases = quick_cut();
  const std::vector<Result> one = run(cases, 1);
  expect_as_expected(one);
  EXPECT_EQ(json_of(one), json_of(run(cases, 3)));
}

TEST(Extreme, TheCatalogueIsWholeAndNamesEachCaseOnce) {
  const std::vector<Case> cases = catalogue();
  EXPECT_GE(cases.size(), 150u);
  std::set<std::string> names;
  std::map<std::string, int> families;
  double bounded = 0;
  for (const Case& c : cases) {
    EXPECT_TRUE(names.insert(c.family + ": " + c.name).second) << c.family << ": " << c.name;
    ++families[c.family];
    bounded += c.expected.verdict == Verdict::kBounded;
    EXPECT_TRUE(c.expected.verdict == Verdict::kAccurate || !c.expected.reason.empty()) << c.name;
  }
  for (const auto& [family, count] : families) EXPECT_GE(count, 4) << family;
  EXPECT_LE(bounded, 0.2 * static_cast<double>(cases.size()));
}

// A judge that lets everything pass proves nothing.
TEST(Extreme, TheJudgeFindsWhatIsNotAsExpected) {
  Outcome fine;
  fine.error = 1e-10;
  EXPECT_EQ(complaint(accurate(1e-9), fine), "");
  EXPECT_NE(complaint(accurate(1e-11), fine), "");
  EXPECT_NE(complaint(refused("because"), fine), "");
  EXPECT_NE(complaint(accurate(1e-9), Outcome{}), "") << "nothing was measured";
  const auto with = [&](auto change) {
    Outcome out = fine;
    change(out);
    return complaint(accurate(1e-9), out);
  };
  EXPECT_NE(with([](Outcome& o) { o.refusal = "because"; }), "");
  EXPECT_NE(with([](Outcome& o) { o.first_bad = Block::kLaw; }), "");
  EXPECT_NE(with([](Outcome& o) { o.bad_at_actuator = true; }), "");
  EXPECT_NE(with([](Outcome& o) { o.energy = 2e-6; }), "");
  EXPECT_NE(with([](Outcome& o) { o.work = o.budget + 1; }), "");
  Outcome stopped;
  stopped.refusal = "master fault: reading is not a number";
  stopped.first_bad = Block::kEncoder;
  EXPECT_EQ(complaint(refused("master fault", Block::kEncoder), stopped), "");
  EXPECT_NE(complaint(refused("slave fault", Block::kEncoder), stopped), "");
  EXPECT_NE(complaint(refused("master fault"), stopped), "");
}

TEST(NightlyExtreme, EveryCaseComesOutAsExpected) { expect_as_expected(run(catalogue(), 2)); }

}  // namespace
}  // namespace farhand::extreme
