// The secret that a therapist's station and a patient's box share: 256 random bits in a file that only its owner can
// read. Whoever has it can move the patient's hand; therefore a file that others can read is refused, not only warned
// about.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

namespace farhand {

class PairingKey {
 public:
  static constexpr std::size_t kBytes = 32;
  using Bytes = std::array<std::uint8_t, kBytes>;

  static PairingKey random();
  // 64 hexadecimal digits, as in the file; white space around them is ignored. Throws std::invalid_argument.
  static PairingKey from_text(std::string_view text);

  explicit PairingKey(const Bytes& bytes) : bytes_(bytes) {}
  PairingKey(const PairingKey&) = default;
  PairingKey& operator=(const PairingKey&) = default;
  ~PairingKey();  // leaves nothing in memory

  const Bytes& bytes() const noexcept { return bytes_; }
  // Name of the key, which the dialing side sends in the clear. Derived from the key by a one-way function.
  std::string identity() const;
  // Check phrase that two people compare after carrying the key over: 64 derived bits as four pronounceable words.
  std::string check_phrase() const;

  bool operator==(const PairingKey&) const = default;

 private:
  Bytes bytes_;
};

// Key file of the user of the program: in $XDG_CONFIG_HOME or ~/.config. Empty if neither exists.
std::filesystem::path default_key_file();

// Throws std::runtime_error with a sentence and a remedy: not there, readable by others, another owner's, not a key.
PairingKey load_key(const std::filesystem::path& file);
// Mode 0600, complete or not at all; makes missing directories (0700). Throws std::runtime_error.
enum class ExistingKey { kRefuse, kReplace };
void store_key(const std::filesystem::path& file, const PairingKey& key, ExistingKey existing);
// Overwrites and removes the file. Only a key file is removed; else it throws like load_key.
void revoke_key(const std::filesystem::path& file);

// SHA-256 as 64 hexadecimal digits, to compare texts without showing them.
std::string fingerprint(std::string_view text);

}  // namespace farhand
