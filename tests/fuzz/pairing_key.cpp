// A file that should hold a key: 64 hexadecimal digits with white space around them, and nothing else is one. What is
// said of it shows none of its content.
#include "common/secure/pairing_key.hpp"

#include <sys/stat.h>

#include <cctype>
#include <optional>
#include <stdexcept>
#include <string>

#include "tests/fuzz/targets.hpp"
#include "tests/support/scratch_directory.hpp"

namespace farhand::fuzz {
namespace {

// Written down anew, from what the file is to look like.
std::optional<PairingKey::Bytes> plain_key(std::string text) {
  const auto space = [](char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; };
  while (!text.empty() && space(text.back())) text.pop_back();
  while (!text.empty() && space(text.front())) text.erase(text.begin());
  if (text.size() != 2 * PairingKey::kBytes) return {};
  PairingKey::Bytes bytes{};
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const std::string two = text.substr(2 * i, 2);
    if (std::isxdigit(static_cast<unsigned char>(two[0])) == 0 ||
        std::isxdigit(static_cast<unsigned char>(two[1])) == 0)
      return {};
    bytes[i] = static_cast<std::uint8_t>(std::stoi(two, nullptr, 16));
  }
  return bytes;
}

// Sixteen digits at the front may be of a key that somebody mistyped.
void require_secret(const std::string& sentence, const std::string& text) {
  const std::string front = text.substr(0, 16);
  const bool digits = front.size() == 16 &&
                      std::all_of(front.begin(), front.end(), [](unsigned char c) { return std::isxdigit(c) != 0; });
  require(!digits || sentence.find(front) == std::string::npos, "a refusal shows nothing of a key");
}

template <class Read>
std::optional<PairingKey::Bytes> read(Read&& read, const std::string& text) {
  try {
    return read().bytes();
  } catch (const std::invalid_argument& error) {
    require_secret(error.what(), text);
  } catch (const std::runtime_error& error) {
    require_secret(error.what(), text);
  }
  return {};
}

}  // namespace

bool pairing_key(Bytes input) {
  static const ScratchDirectory scratch;
  static const auto file = scratch / "key";
  const std::string text(input.begin(), input.end());
  const auto expected = plain_key(text);
  require(read([&] { return PairingKey::from_text(text); }, text) == expected, "a key is what looks like one");

  write_bytes(file, text);
  ::chmod(file.c_str(), 0600);
  // Only its beginning is read: what goes on for longer than a key and some space is none.
  const auto loaded = read([&] { return load_key(file); }, text);
  require(!loaded || loaded == plain_key(text.substr(0, 128)), "a file holds the key that it shows");
  require(text.size() > 128 || loaded == expected, "a short file is read as its text");
  if (!expected) return false;

  const PairingKey key(*expected);
  require(key.identity().size() == 16 && key.check_phrase().size() == 23, "identity and phrase have their lengths");
  require(text.find(key.identity()) == std::string::npos, "the identity is not of the key");
  store_key(file, key, ExistingKey::kReplace);
  require(load_key(file) == key, "what is stored is read back");
  return true;
}

}  // namespace farhand::fuzz
