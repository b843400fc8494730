// The fuzzers' targets without a fuzzer: every file of their corpora, then mutations of those from a fixed seed. Each
// file of the corpus stands for something (its name says what) or was once a finding.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>
#include <vector>

#include "tests/fuzz/targets.hpp"
#include "tests/support/scratch_directory.hpp"

namespace farhand::fuzz {
namespace {

struct File {
  std::string name, bytes;
};

std::vector<File> corpus_of(const std::string& target) {
  std::vector<File> files;
  for (const auto& entry : std::filesystem::directory_iterator(std::filesystem::path(FARHAND_CORPUS) / target)) {
    files.push_back({entry.path().filename(), file_bytes(entry.path())});
  }
  std::sort(files.begin(), files.end(), [](const File& a, const File& b) { return a.name < b.name; });
  return files;
}

// A broken promise leaves its input behind, to be looked at and kept in the corpus.
bool run(const Target& target, const std::string& input, const std::string& name) {
  try {
    return target.run({reinterpret_cast<const std::uint8_t*>(input.data()), input.size()});
  } catch (const Broken& broken) {
    const auto file = std::filesystem::temp_directory_path() / (std::string("found_") + target.name);
    write_bytes(file, input);
    ADD_FAILURE() << target.name << ", " << name << ": not kept: " << broken.promise << "; the input is in " << file;
  }
  return false;
}

class Mutator {
 public:
  explicit Mutator(const std::vector<File>& files) : files_(files) {}

  std::string next() {
    std::string text = any();
    for (std::uint64_t edits = 1 + bits_() % 4; edits > 0; --edits) edit(text);
    return text;
  }

 private:
  const std::string& any() { return files_[bits_() % files_.size()].bytes; }

  void edit(std::string& text) {
    if (text.empty()) text.push_back(static_cast<char>(bits_()));
    const std::size_t at = bits_() % text.size();
    switch (bits_() % 6) {
      case 0:
        text[at] = static_cast<char>(text[at] ^ 1 << bits_() % 8);
        return;
      case 1:
        text[at] = static_cast<char>(bits_());
        return;
      case 2:
        text.erase(at, 1 + bits_() % 8);
        return;
      case 3:
        text.insert(at, text.substr(bits_() % text.size(), bits_() % 64));
        return;
      case 4:
        text.resize(at);
        return;
      default: {
        const std::string& other = any();
        text.insert(at, other.substr(bits_() % (other.size() + 1), bits_() % 128));
      }
    }
  }

  const std::vector<File>& files_;
  std::mt19937_64 bits_{1};
};

// Two targets write files and sync them; in memory that takes no time.
const bool kInMemory = std::filesystem::exists("/dev/shm") && ::setenv("TMPDIR", "/dev/shm", 0) == 0;

class FuzzTarget : public testing::TestWithParam<std::pair<int, int>> {};

TEST_P(FuzzTarget, KeepsItsPromisesOnItsCorpusAndOnMutationsOfIt) {
  const auto [which, mutations] = GetParam();
  const Target& target = kTargets[which];
  const std::vector<File> files = corpus_of(target.name);
  ASSERT_FALSE(files.empty());
  for (const File& file : files) {
    const bool taken = run(target, file.bytes, file.name);
    EXPECT_TRUE(taken || !file.name.starts_with("good"))
        << target.name << "/" << file.name
        << " holds nothing valid any more: run farhand_fuzz_corpus tests/fuzz/corpus";
  }
  Mutator mutator(files);
  int taken = 0;
  for (int i = 0; i < mutations && !HasFailure(); ++i) {
    if (run(target, mutator.next(), "mutation " + std::to_string(i))) ++taken;
  }
  std::printf("%s: %zu files, %d mutations, %d of them with something valid%s\n", target.name, files.size(), mutations,
              taken, kInMemory ? "" : "; on a disk");
}

INSTANTIATE_TEST_SUITE_P(Each, FuzzTarget,
                         testing::Values(std::pair{0, 20'000}, std::pair{1, 200}, std::pair{2, 20'000},
                                         std::pair{3, 5'000}, std::pair{4, 10'000}, std::pair{5, 1'000},
                                         std::pair{6, 2'000}, std::pair{7, 10'000}),
                         [](const auto& which) { return kTargets[which.param.first].name; });

}  // namespace
}  // namespace farhand::fuzz
