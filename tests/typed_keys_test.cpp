// What the keys of a terminal mean, in virtual time: whoever looks each millisecond, at people who type fast and
// slowly.
#include "common/runtime/typed_keys.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include "common/runtime/operator_words.hpp"

namespace farhand {
namespace {

using enum OperatorAct;
using Acts = std::vector<OperatorAct>;

class Typist {
 public:
  explicit Typist(Nanoseconds before = 2 * kSecond) { wait(before); }

  Typist& wait(Nanoseconds duration) {
    for (const Nanoseconds end = now_ + duration; now_ < end;) note(keys_.quiet(now_ += kMillisecond));
    return *this;
  }
  // Each key `pace` after the one before.
  Typist& type(const std::string& text, Nanoseconds pace = 0) {
    for (const char c : text) {
      note(keys_.take(c));
      wait(pace);
    }
    return *this;
  }
  Typist& stall(Nanoseconds duration) {
    now_ += duration;
    return *this;
  }

  Acts take() { return std::exchange(acts_, {}); }
  bool asked_to_move() const { return std::any_of(acts_.begin(), acts_.end(), needs_intent); }
  bool stopped() const { return std::count(acts_.begin(), acts_.end(), kStop) > 0; }
  std::string said() { return sentence_of(said_); }

 private:
  void note(std::optional<OperatorAct> act) {
    if (act) acts_.push_back(*act);
    if (const InputRemark remark = keys_.take_remark(); remark.kind != InputRemark::Kind::kNone) said_ = remark;
  }

  TypedKeys keys_;
  Nanoseconds now_ = 0;
  Acts acts_;
  InputRemark said_;
};

const Acts kNothing;
constexpr Nanoseconds kTenth = kSecond / 10;

// With caps lock, right at the start, in the midst of other keys, and while nobody has looked for silence.
TEST(TypedKeys, EveryKeyThatCouldBeMeantAsStopStopsAtOnceWhateverCameBefore) {
  std::string keys = "sSqQ ";
  for (char c = 0; c < ' '; ++c) {
    if (c != 0x08 && c != 0x15) keys += c;  // Backspace and Ctrl-U
  }
  const std::vector<std::string> before{"",         "x",    "e",     "M",       "Meier", "rese",
                                        "engage",   "\x1b", "\x1b[", "\x1b[12", "\x1bO", std::string(500, 'x'),
                                        "\xC3\xBC", "\xC3"};
  for (const std::string& text : before) {
    for (const Nanoseconds pause : {Nanoseconds{0}, kTenth, kSecond / 2, 5 * kSecond}) {
      for (const char key : keys) {
        Typist typist(0);
        typist.type(text).wait(pause).take();
        typist.type({key});
        if (text == "engage" && key != '\x1b' && (key == '\n' || key == '\r')) continue;  // a word
        EXPECT_TRUE(typist.stopped()) << "after \"" << text << "\", key " << int{key};
      }
    }
  }
}

TEST(TypedKeys, TheWordsStopInAnyCaseAndAtTheirFirstLetter) {
  for (const std::string word : {"stop", "STOP", "Stop", "sTOP", "quit", "Quit", "QUIT"}) {
    for (const Nanoseconds pace : {Nanoseconds{0}, kTenth, kSecond / 2}) {
      Typist typist;
      typist.type(word.substr(0, 1));
      EXPECT_EQ(typist.take(), Acts{kStop}) << word;
      typist.wait(pace).type(word.substr(1) + "\n", pace);
      EXPECT_EQ(typist.take().back(), kStop) << word;
      EXPECT_FALSE(typist.wait(kSecond * 2).asked_to_move());
    }
  }
}

TEST(TypedKeys, HoldIsDoneAtOnce) {
  for (const char* key : {"h", "H"}) EXPECT_EQ(Typist(0).type(key).take(), Acts{kHold});
  EXPECT_EQ(Typist(0).type("hold\n").take(), (Acts{kHold, kHold}));
  EXPECT_EQ(Typist(0).type("HOLD\n").take(), (Acts{kHold, kHold}));
}

const std::pair<char, OperatorAct> kLetters[] = {
    {'e', kEngage}, {'r', kReset}, {'o', kHome}, {'i', kIdentify}, {'f', kSweep}};
const std::pair<std::string, OperatorAct> kWords[] = {
    {"engage", kEngage}, {"reset", kReset}, {"home", kHome}, {"identify", kIdentify}, {"friction", kSweep}};

TEST(TypedKeys, ALetterAloneActsOnceASecondAfterItsKey) {
  for (const auto& [letter, act] : kLetters) {
    Typist typist;
    typist.type({letter}).wait(kSecond);
    EXPECT_EQ(typist.take(), kNothing);
    EXPECT_EQ(typist.wait(2 * kMillisecond).take(), Acts{act});
    EXPECT_EQ(typist.wait(10 * kSecond).take(), kNothing);
    EXPECT_NE(typist.said().find(name_of(act)), std::string::npos) << typist.said();
  }
}

// 0.3 s before it, 1 s after it, whatever the other key is.
TEST(TypedKeys, ALetterWithAnotherKeyAroundItDoesNotAct) {
  for (const auto& [letter, act] : kLetters) {
    for (int other = 1; other < 256; ++other) {
      const std::string key{static_cast<char>(other)};
      Typist after;
      after.type({letter}).wait(kSecond - kMillisecond).type(key).wait(5 * kSecond);
      Acts acts = after.take();
      const bool that_acts =
          std::any_of(std::begin(kLetters), std::end(kLetters), [&](const auto& one) { return one.first == other; });
      EXPECT_EQ(std::count_if(acts.begin(), acts.end(), needs_intent), 0) << letter << other << that_acts;
      Typist before;
      before.type(key).wait(kTenth * 3 - 2 * kMillisecond).type({letter}).wait(5 * kSecond);
      EXPECT_FALSE(before.asked_to_move()) << other << letter;
    }
  }
}

TEST(TypedKeys, AWordWithEnterActsAlone) {
  for (const auto& [word, act] : kWords) {
    for (const Nanoseconds pace : {Nanoseconds{0}, 2 * kTenth, 9 * kTenth}) {
      for (const char* enter : {"\n", "\r"}) {
        Typist typist;
        if (word == "home" && pace > kTenth * 3) continue;  // its h is a key that has been done by then
        typist.type(word, pace);
        EXPECT_EQ(typist.stopped(), word == "reset") << "its s";
        EXPECT_FALSE(typist.asked_to_move());
        typist.take();
        typist.type(enter);
        EXPECT_EQ(typist.take(), kNothing);
        EXPECT_EQ(typist.wait(kTenth * 3 + 2 * kMillisecond).take(), Acts{act}) << word;
        EXPECT_EQ(typist.wait(5 * kSecond).take(), kNothing);
      }
    }
  }
}

TEST(TypedKeys, AWordIsNoneInOtherCaseInALongerLineOrAmongOtherLines) {
  for (const auto& [word, act] : kWords) {
    std::string capitals = word;
    for (char& c : capitals) c = static_cast<char>(c - 'a' + 'A');
    for (const std::string& line :
         {capitals, word + " ", " " + word, word + "s", "x" + word, word + "\n" + word, "ls\n" + word, word + "\nls",
          "\n" + word, word + "\n", word + "\x1b[201~", "\x1b[200~" + word, word + "\r"}) {
      Typist typist;
      typist.type(line + "\n").wait(5 * kSecond);
      EXPECT_FALSE(typist.asked_to_move()) << line;
      EXPECT_TRUE(typist.stopped()) << line;
    }
  }
}

const char* const kTexts[] = {"Meier",
                              "Herr Meier",
                              "Frau Dr. Erika Rossi",
                              "Peter",
                              "Rhodri O'Reilly",
                              "emil",
                              "rudi",
                              "Otto",
                              "ida",
                              "r2d2",
                              "Srinivas",
                              "Sr. Meier",
                              "Anna e Marco",
                              "io e te",
                              "e o i r",
                              "Se",
                              "qr",
                              "hoho",
                              "he is here or i err",
                              "erste Reihe",
                              "the hand is stiff here",
                              "cd build/release && ctest -R e",
                              "ls -r",
                              "grep -r e .",
                              "for i in e r; do echo $i; done",
                              "rm -i e",
                              "reset the box",
                              "please engage",
                              "home sweet home",
                              "engage!",
                              "\xC3\xA4 \xC3\xB6 e",
                              "1 2 3 e",
                              "x",
                              "xe",
                              "+e-"};

// Up to a second for each letter, and then for ever: what lies in the line is not forgotten.
TEST(TypedKeys, NamesSentencesAndShellLinesNeverLetAnythingMoveHoweverSlowlyTheyAreTyped) {
  for (const std::string text : kTexts) {
    for (int pace_ms = 0; pace_ms < 1000; pace_ms += pace_ms < 400 ? 33 : 111) {
      for (const std::string end : {"", "\n", "\x1b", "\t"}) {
        Typist typist;
        typist.type(text + end, pace_ms * kMillisecond);
        if (text.size() == 1 || !end.empty()) typist.wait(10 * kSecond);
        EXPECT_FALSE(typist.asked_to_move()) << text << ", " << pace_ms << " ms";
        if (end != "") {
          EXPECT_TRUE(typist.stopped()) << text;
        }
      }
    }
  }
}

TEST(TypedKeys, ALetterAfterUnfinishedTextNeverCounts) {
  for (const char first : {'M', 'x', '1', '-', '\xC3'}) {
    for (const auto& [letter, act] : kLetters) {
      Typist typist;
      typist.type({first})
          .wait(3600 * kSecond / 100)
          .type({letter})
          .wait(20 * kSecond)
          .type({letter})
          .wait(20 * kSecond);
      EXPECT_EQ(typist.take(), kNothing);
      EXPECT_NE(typist.said().find("Backspace"), std::string::npos) << typist.said();
    }
  }
}

TEST(TypedKeys, BackspaceTakesLettersBackAndCtrlUTheLine) {
  for (const std::string back : {"\x7f\x7f", "\x08\x08", "\x15"}) {
    Typist typist;
    typist.type("x\xC3\xBC").wait(kSecond / 2).type(back).wait(kSecond / 2).type("e").wait(2 * kSecond);
    EXPECT_EQ(typist.take(), Acts{kEngage});
  }
  Typist typist;
  typist.type("xy\x7f").wait(kSecond).type("e").wait(5 * kSecond);
  EXPECT_EQ(typist.take(), kNothing) << "an x is left";
}

// What has been done lies in no line: the first of all uses is s, and later r.
TEST(TypedKeys, AfterAStopALetterAloneActs) {
  for (const std::string stop :
       {"s", "S", "q", " ", "\n", "\x1b", "ssssssss", "h", "stop\n", "Meier\n", "\x1b[A", "\x13"}) {
    Typist typist;
    typist.type(stop, kTenth / 3).wait(kTenth * 3).take();
    typist.type("r").wait(kSecond + 2 * kMillisecond);
    EXPECT_EQ(typist.take(), Acts{kReset}) << stop;
  }
}

TEST(TypedKeys, ArrowsBracketsAndAnswersStopAndNeverMoveAnything) {
  for (const std::string sequence :
       {"\x1b[A", "\x1b[1;5C", "\x1bOr", "\x1b[[E", "\x1b[200~", "\x1b[201~", "\x1b[<0;10;12M", "\x1b[3~",
        "\x1b[?62;22c", "\x1b[24;80R", "\x1b]11;rgb:0000/0000/0000\x1b\\", "\x1bP1$r0m\x1b\\", "\x1b[I", "\x1b[O",
        "\x1b"
        "e",
        "\x1br", "\x1b[M !!"}) {
    for (const Nanoseconds pace : {Nanoseconds{0}, kTenth, 4 * kTenth}) {
      Typist typist;
      typist.type(sequence, pace).wait(5 * kSecond);
      EXPECT_TRUE(typist.stopped());
      // Esc and, half a second later, a letter are two keys.
      EXPECT_EQ(typist.asked_to_move(), sequence.size() == 2 && pace > 3 * kTenth) << sequence.substr(1) << " " << pace;
    }
  }
  // A whole one leaves nothing behind.
  for (const std::string sequence : {"\x1b[A", "\x1b[1;5C", "\x1bOr", "\x1b[[E", "\x1b[200~", "\x1b[<0;10;12M"}) {
    Typist typist;
    typist.type(sequence).wait(kSecond / 2).take();
    EXPECT_EQ(typist.type("e").wait(2 * kSecond).take(), Acts{kEngage}) << sequence.substr(1);
  }
}

// A name whose first two keys came while the program stood still, on either side of its standing.
TEST(TypedKeys, TimeInWhichNobodyLookedIsNoSilence) {
  for (const Nanoseconds stall : {kSecond / 2, 2 * kSecond, 100 * kSecond}) {
    Typist typist;
    typist.type("e").stall(stall).type("r").wait(5 * kSecond);
    EXPECT_EQ(typist.take(), kNothing);
    typist.type("\n").wait(kTenth).stall(stall).type("e").wait(5 * kSecond);
    EXPECT_EQ(typist.take(), Acts{kStop}) << "0.1 s of it was seen";
  }
  EXPECT_FALSE(Typist(kTenth).type("e").wait(5 * kSecond).asked_to_move()) << "nobody knows what came before the start";
}

TEST(TypedKeys, WhatIsForgottenDoesNotAct) {
  TypedKeys keys;
  for (Nanoseconds t = 0; t < kSecond; t += kMillisecond) keys.quiet(t);
  keys.take('e');
  keys.forget();
  for (Nanoseconds t = kSecond; t < 5 * kSecond; t += kMillisecond) EXPECT_EQ(keys.quiet(t), std::nullopt);
}

TEST(TypedKeys, SayWhatIsNotUnderstoodInPrintableLetters) {
  Typist typist;
  typist
      .type(
          "M\xC3\xBC"
          "ller")
      .wait(2 * kSecond);
  EXPECT_NE(typist.said().find("\"M?ller\""), std::string::npos) << typist.said();
  typist.type("\n").wait(kSecond);
  EXPECT_NE(typist.said().find("\"M?ller\" is no word"), std::string::npos) << typist.said();
  typist.type(std::string(300, 'x')).wait(2 * kSecond);
  EXPECT_NE(typist.said().find("\"" + std::string(24, 'x') + "...\""), std::string::npos) << typist.said();
  typist.type("\n").wait(kSecond).type("reset\nls\n").wait(kSecond);
  EXPECT_NE(typist.said().find("\"ls\""), std::string::npos) << typist.said();
}

// Any keys at any pace: whoever has not left a letter or a word alone has asked for no motion; each stop key stops.
TEST(TypedKeys, RandomKeysMoveNothingWithoutALetterOrAWordAlone) {
  std::mt19937_64 random(3);
  const std::string_view alphabet = "eroihsq \n\x1b[\x7fxAO~0";
  int moved = 0, stops = 0;
  for (int round = 0; round < 3000; ++round) {
    std::vector<std::pair<char, Nanoseconds>> typed;  // and the time before it
    Typist typist(kSecond);
    Acts all;
    for (int k = 0; k < 12; ++k) {
      const char c = alphabet[random() % alphabet.size()];
      const auto pause = static_cast<Nanoseconds>(random() % 4 == 0 ? random() % 1600 : random() % 250) * kMillisecond;
      for (const OperatorAct act : typist.wait(pause).take()) all.push_back(act);
      typed.emplace_back(c, pause);
      typist.type({c});
      const Acts at_once = typist.take();
      if (c == 's' || c == 'q' || c == ' ' || c == '\n' || c == '\x1b') {
        ASSERT_EQ(at_once, Acts{kStop}) << round;  // no whole word is in this alphabet
        ++stops;
      }
      ASSERT_EQ(std::count_if(at_once.begin(), at_once.end(), needs_intent), 0) << "a key alone never moves anything";
    }
    for (const OperatorAct act : typist.wait(2 * kSecond).take()) all.push_back(act);
    typed.emplace_back('\n', 2 * kSecond);
    std::ptrdiff_t may = 0;
    for (std::size_t k = 0; k + 1 < typed.size(); ++k) {
      const bool letter = std::string_view("eroi").find(typed[k].first) != std::string_view::npos;
      may += letter && (k == 0 || typed[k].second >= 300 * kMillisecond) && typed[k + 1].second >= kSecond;
    }
    const auto did = std::count_if(all.begin(), all.end(), needs_intent);
    ASSERT_LE(did, may) << round;
    moved += did > 0;
  }
  EXPECT_GT(moved, 100);
  EXPECT_GT(stops, 5000);
}

}  // namespace
}  // namespace farhand
